#include "client/cli/rows/part_list.h"

#include <cmath>
#include <initializer_list>
#include <limits>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr size_t kMaxParts = 64;

absl::Status wrong(size_t part, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("parts: part ", part, ": ", what));
}

absl::StatusOr<Json> read_list(absl::string_view text) {
  Json list = Json::parse(text.begin(), text.end(), nullptr, /*allow_exceptions=*/false);
  if (!list.is_array()) return absl::InvalidArgumentError("parts: is no JSON list of parts in braces");
  if (list.empty() || list.size() > kMaxParts) {
    return absl::InvalidArgumentError(
        absl::StrCat("parts: a compound has 1 to ", kMaxParts, " parts, not ", list.size()));
  }
  for (size_t part = 0; part < list.size(); ++part) {
    if (!list[part].is_object()) return wrong(part, "is no object in braces");
  }
  return list;
}

absl::Status check_keys(size_t part, const Json& object, std::initializer_list<const char*> known) {
  for (const auto& [key, value] : object.items()) {
    bool found = false;
    for (const char* name : known) found |= key == name;
    if (!found)
      return wrong(part,
                   absl::StrCat("unknown key '", key.substr(0, 40), "'; known are: ", absl::StrJoin(known, ", ")));
  }
  return absl::OkStatus();
}

absl::StatusOr<float> read_float(size_t part, const char* key, const Json& value) {
  const double number = value.is_number() ? value.get<double>() : std::numeric_limits<double>::infinity();
  if (!(std::abs(number) <= std::numeric_limits<float>::max())) return wrong(part, absl::StrCat(key, ": is no number"));
  return static_cast<float>(number);
}

template <size_t kCount>
absl::Status read_floats(size_t part, const char* key, const Json& value, std::array<float, kCount>& to) {
  if (!value.is_array() || value.size() != kCount)
    return wrong(part, absl::StrCat(key, ": is no list of ", kCount, " numbers"));
  for (size_t i = 0; i < kCount; ++i) {
    ASSIGN_OR_RETURN(to[i], read_float(part, key, value[i]));
  }
  return absl::OkStatus();
}

absl::Status read_pose(size_t part, const Json& object, PartRow& row) {
  if (object.contains("at")) RETURN_IF_ERROR(read_floats(part, "at", object["at"], row.at));
  if (object.contains("rotation")) RETURN_IF_ERROR(read_floats(part, "rotation", object["rotation"], row.rotation));
  return absl::OkStatus();
}

client::Float3 float3_of(const std::array<float, 3>& values) { return {values[0], values[1], values[2]}; }

absl::Status read_part(size_t part, const Json& object, client::Compound& compound) {
  RETURN_IF_ERROR(check_keys(part, object, {"ball", "box", "capsule", "at", "rotation", "layers"}));
  if (object.contains("ball") + object.contains("box") + object.contains("capsule") != 1) {
    return wrong(part, "needs one of ball, box and capsule");
  }
  if (!object.contains("at")) return wrong(part, "at: is missing");
  PartRow row;
  RETURN_IF_ERROR(read_pose(part, object, row));
  client::PartOptions options = {.rotation = {row.rotation[0], row.rotation[1], row.rotation[2], row.rotation[3]}};
  if (object.contains("layers")) {
    const Json& layers = object["layers"];
    if (!layers.is_number_unsigned() || layers.get<uint64_t>() > client::kAllLayers)
      return wrong(part, "layers: is no whole number from 0 to 4294967295");
    options.layers = layers.get<uint32_t>();
  }
  if (object.contains("ball")) {
    ASSIGN_OR_RETURN(const float radius, read_float(part, "ball", object["ball"]));
    compound.ball(float3_of(row.at), radius, options);
  } else if (object.contains("box")) {
    RETURN_IF_ERROR(read_floats(part, "box", object["box"], row.size));
    compound.box(float3_of(row.at), float3_of(row.size), options);
  } else {
    const Json& capsule = object["capsule"];
    if (!capsule.is_object() || !capsule.contains("axis") || !capsule.contains("radius")) {
      return wrong(part, "capsule: needs axis and radius, in braces");
    }
    RETURN_IF_ERROR(check_keys(part, capsule, {"axis", "radius"}));
    RETURN_IF_ERROR(read_floats(part, "axis", capsule["axis"], row.size));
    ASSIGN_OR_RETURN(const float radius, read_float(part, "radius", capsule["radius"]));
    compound.capsule(float3_of(row.at), float3_of(row.size), radius, options);
  }
  return absl::OkStatus();
}

// Returns whether a column has `rows` entries, one for all or, if it may be absent, none.
bool fits(int size, int width, int rows, bool optional) {
  return size == rows * width || size == width || (optional && size == 0);
}

bool has_part_columns(const v1::Parts& parts) {
  const int rows = parts.positions_size() / 3;
  if (parts.positions_size() % 3 != 0 || !fits(parts.rotations_size(), 4, rows, true) ||
      !fits(parts.layers_size(), 1, rows, true)) {
    return false;
  }
  switch (parts.shape_case()) {
    case v1::Parts::kBall:
      return fits(parts.ball().radii_size(), 1, rows, false);
    case v1::Parts::kBox:
      return fits(parts.box().half_extents_size(), 3, rows, false);
    case v1::Parts::kCapsule:
      return fits(parts.capsule().radii_size(), 1, rows, false) &&
             fits(parts.capsule().half_axes_size(), 3, rows, false);
    case v1::Parts::SHAPE_NOT_SET:
      return false;
  }
  return false;
}

// Reads entry `row` of a column that may have one entry for all rows; leaves `to` as it is if the column is absent.
template <class Repeated, size_t kCount>
void read_entry(const Repeated& column, int row, std::array<float, kCount>& to) {
  const int width = static_cast<int>(kCount);
  if (column.empty()) return;
  const int first = column.size() == width ? 0 : row * width;
  for (int i = 0; i < width; ++i) to[static_cast<size_t>(i)] = column.Get(first + i);
}

PartRow part_of(const v1::Parts& parts, int row) {
  PartRow part = {.shape = parts.shape_case()};
  std::array<float, 1> radius{};
  read_entry(parts.positions(), row, part.at);
  read_entry(parts.rotations(), row, part.rotation);
  if (!parts.layers().empty()) part.layers = parts.layers(parts.layers_size() == 1 ? 0 : row);
  if (parts.has_ball()) read_entry(parts.ball().radii(), row, radius);
  if (parts.has_box()) read_entry(parts.box().half_extents(), row, part.size);
  if (parts.has_capsule()) {
    read_entry(parts.capsule().radii(), row, radius);
    read_entry(parts.capsule().half_axes(), row, part.size);
  }
  part.radius = radius[0];
  return part;
}

}  // namespace

absl::StatusOr<client::Compound> read_parts(absl::string_view text) {
  ASSIGN_OR_RETURN(const Json list, read_list(text));
  client::Compound compound;
  for (size_t part = 0; part < list.size(); ++part) RETURN_IF_ERROR(read_part(part, list[part], compound));
  return compound;
}

absl::StatusOr<PoseColumns> read_poses(absl::string_view text) {
  ASSIGN_OR_RETURN(const Json list, read_list(text));
  PoseColumns columns = {.parts_each = static_cast<uint32_t>(list.size())};
  const bool moved = list[0].contains("at"), rotated = list[0].contains("rotation");
  for (size_t part = 0; part < list.size(); ++part) {
    RETURN_IF_ERROR(check_keys(part, list[part], {"at", "rotation"}));
    if (list[part].contains("at") != moved || list[part].contains("rotation") != rotated || !(moved || rotated)) {
      return wrong(part, "either all parts or none have at, and the same for rotation; one of them is needed");
    }
    PartRow row;
    RETURN_IF_ERROR(read_pose(part, list[part], row));
    if (moved) columns.positions.insert(columns.positions.end(), row.at.begin(), row.at.end());
    if (rotated) columns.rotations.insert(columns.rotations.end(), row.rotation.begin(), row.rotation.end());
  }
  return columns;
}

bool for_each_part(const v1::Compound& compound, const std::function<void(const PartRow&)>& take) {
  for (const v1::Parts& parts : compound.parts()) {
    if (!has_part_columns(parts)) return false;
    for (int row = 0; row < parts.positions_size() / 3; ++row) take(part_of(parts, row));
  }
  return true;
}

Json parts_json(const v1::Compound& compound) {
  Json list = Json::array();
  for_each_part(compound, [&](const PartRow& part) {
    Json json = Json::object();
    if (part.shape == v1::Parts::kBall) json["ball"] = float_json(part.radius);
    if (part.shape == v1::Parts::kBox) json["box"] = floats_json(part.size);
    if (part.shape == v1::Parts::kCapsule)
      json["capsule"] = {{"axis", floats_json(part.size)}, {"radius", float_json(part.radius)}};
    json["at"] = floats_json(part.at);
    json["rotation"] = floats_json(part.rotation);
    json["layers"] = part.layers;
    list.push_back(std::move(json));
  });
  return list;
}

}  // namespace locus::cli
