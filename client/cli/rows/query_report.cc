#include "client/cli/rows/query_report.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "client/cli/rows/past_options.h"
#include "client/lib/result_rows.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

using client::ResultRows;

Json point_json(const ResultRows& rows, size_t row, const client::Double3& frame) {
  const absl::Span<const float> offset = rows.points().subspan(row * 3, 3);
  if (frame.x == 0 && frame.y == 0 && frame.z == 0) return floats_json(offset);
  return doubles_json({frame.x + offset[0], frame.y + offset[1], frame.z + offset[2]});
}

Json triangle_json(uint32_t triangle) { return triangle == client::kNoTriangle ? Json() : Json(triangle); }

// Sets the keys of COLUMN_SHAPE: the kind of shape, and those of its sizes that the kind has; the others are null.
void add_shape(const ResultRows& rows, size_t row, Json& json) {
  enum Kind : uint32_t { kPoint = 1, kBall = 2, kBox = 3, kCapsule = 4, kInstance = 5, kCompound = 6 };
  constexpr std::array<const char*, 7> kNames = {nullptr, "point", "ball", "box", "capsule", "instance", "compound"};
  const uint32_t kind = rows.shapes().empty() ? 0 : rows.shapes()[row];
  for (const char* key : {"shape", "radius", "half", "axis", "scale", "parts"}) json[key] = Json();
  if (kind == 0 || kind >= kNames.size()) return;
  const absl::Span<const float> sizes = rows.sizes().subspan(row * 4, 4);
  json["shape"] = kNames[kind];
  if (kind == kBall || kind == kCapsule || kind == kCompound) json["radius"] = float_json(sizes[0]);
  if (kind == kBox) json["half"] = floats_json(sizes.subspan(1));
  if (kind == kCapsule) json["axis"] = floats_json(sizes.subspan(1));
  if (kind == kInstance) json["scale"] = float_json(sizes[0]);
  if (kind == kCompound) json["parts"] = static_cast<uint32_t>(sizes[1]);
}

// Sets the key or keys of `column` in `json`. `json` becomes the row of the report that shows row `row` of the answer.
// The value is null if the answer does not contain the column, or if the row has id 0. A row with id 0 is a miss or, in
// the answer to a cell query, the ball that bounds the space. Exception: the t of such a ball is not null, but the
// ball's radius.
void add_column(const ResultRows& rows, size_t row, const RowLayout& layout, v1::Column column, Json& json) {
  const bool hit = rows.ids().empty() || rows.ids()[row] != 0;
  const auto add = [&](const char* key, bool present, const auto& value) {
    json[key] = hit && present ? value() : Json();
  };
  switch (column) {
    case v1::COLUMN_T:
      json["t"] = (hit || !layout.dense) && !rows.t().empty() ? float_json(rows.t()[row]) : Json();
      return;
    case v1::COLUMN_ID:
      return add("id", !rows.ids().empty(), [&] { return id_json(rows.ids()[row]); });
    case v1::COLUMN_TRIANGLE:
      return add("triangle", !rows.triangles().empty(), [&] { return triangle_json(rows.triangles()[row]); });
    case v1::COLUMN_UV:
      return add("uv", !rows.uvs().empty(), [&] { return floats_json(rows.uvs().subspan(row * 2, 2)); });
    case v1::COLUMN_NORMAL:
      return add("normal", !rows.normals().empty(), [&] { return floats_json(rows.normals().subspan(row * 3, 3)); });
    case v1::COLUMN_POINT:
      return add("point", !rows.points().empty(), [&] { return point_json(rows, row, layout.frame); });
    case v1::COLUMN_GROUP:
      return add("group", !rows.groups().empty(), [&] { return id_json(rows.groups()[row]); });
    case v1::COLUMN_TAG:
      return add("tag", !rows.tags().empty(), [&] { return id_json(rows.tags()[row]); });
    case v1::COLUMN_LAYERS:
      return add("layers", !rows.layers().empty(), [&] { return Json(rows.layers()[row]); });
    case v1::COLUMN_OTHER:
      return add("other", !rows.others().empty(), [&] { return id_json(rows.others()[row]); });
    case v1::COLUMN_POSE:
      add("position", !rows.positions().empty(), [&] { return doubles_json(rows.positions().subspan(row * 3, 3)); });
      return add("rotation", !rows.rotations().empty(),
                 [&] { return floats_json(rows.rotations().subspan(row * 4, 4)); });
    case v1::COLUMN_SHAPE:
      return add_shape(rows, row, json);
    default:
      return;
  }
}

const std::vector<std::string>& keys_of(v1::Column column) {
  static const auto& keys = *new std::map<v1::Column, std::vector<std::string>>{
      {v1::COLUMN_T, {"t"}},
      {v1::COLUMN_ID, {"id"}},
      {v1::COLUMN_TRIANGLE, {"triangle"}},
      {v1::COLUMN_UV, {"uv"}},
      {v1::COLUMN_NORMAL, {"normal"}},
      {v1::COLUMN_POINT, {"point"}},
      {v1::COLUMN_GROUP, {"group"}},
      {v1::COLUMN_TAG, {"tag"}},
      {v1::COLUMN_LAYERS, {"layers"}},
      {v1::COLUMN_OTHER, {"other"}},
      {v1::COLUMN_UNSPECIFIED, {}},
      {v1::COLUMN_POSE, {"position", "rotation"}},
      {v1::COLUMN_SHAPE, {"shape", "radius", "half", "axis", "scale", "parts"}}};
  const auto found = keys.find(column);
  return found == keys.end() ? keys.at(v1::COLUMN_UNSPECIFIED) : found->second;
}

}  // namespace

std::vector<std::string> row_keys(const RowLayout& layout) {
  std::vector<std::string> keys;
  if (!layout.query.empty()) keys.push_back(layout.query);
  if (layout.dense) keys.emplace_back("hit");
  for (const v1::Column column : layout.columns) {
    for (const std::string& key : keys_of(column)) {
      if (std::find(keys.begin(), keys.end(), key) == keys.end()) keys.push_back(key);
    }
  }
  if (layout.as_of) keys.emplace_back("as_of");
  return keys;
}

absl::StatusOr<std::vector<Json>> rows_json(const v1::BlockResult& block, const RowLayout& layout) {
  ASSIGN_OR_RETURN(const ResultRows rows, ResultRows::of(block));
  const Json times = layout.as_of ? resolved_json(block) : Json::array();
  std::vector<Json> result;
  for (size_t query = 0; query < rows.queries(); ++query) {
    const client::RowRange range = rows.rows_of(query);
    for (size_t row = range.begin; row < range.end; ++row) {
      Json json = Json::object();
      if (!layout.query.empty()) json[layout.query] = layout.first_query + query;
      if (layout.dense) json["hit"] = rows.ids().empty() || rows.ids()[row] != 0;
      for (const v1::Column column : layout.columns) add_column(rows, row, layout, column, json);
      if (layout.as_of) json["as_of"] = query < times.size() ? times[query] : Json();
      result.push_back(std::move(json));
    }
  }
  return result;
}

Json work_json(const v1::Work& work) {
  return {
      {"nodes", work.nodes()}, {"cells", work.cells()}, {"tests", work.tests()}, {"nanoseconds", work.nanoseconds()}};
}

Json result_head(const v1::QueryResult& result) {
  Json head = {{"epoch", id_json(result.epoch())}, {"revision", result.revision()}, {"tick", result.tick()}};
  for (const v1::BlockResult& block : result.blocks()) {
    for (const uint32_t query : block.truncated()) head["truncated"].push_back(query);
    for (Json& time : resolved_json(block)) head["as_of"].push_back(std::move(time));
    for (const uint32_t query : block.clamped()) head["clamped"].push_back(query);
    for (const uint32_t query : block.unanchored()) head["unanchored"].push_back(query);
  }
  if (result.has_work()) head["work"] = work_json(result.work());
  return head;
}

}  // namespace locus::cli
