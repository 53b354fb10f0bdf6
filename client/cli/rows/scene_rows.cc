#include "client/cli/rows/scene_rows.h"

#include "client/cli/rows/part_list.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

absl::Status damaged() {
  return absl::DataLossError("the dump came damaged: a column has another length than its ids; dump again");
}

template <class Repeated, size_t kCount>
void read(const Repeated& column, int row, std::array<typename Repeated::value_type, kCount>* to) {
  for (size_t i = 0; i < kCount; ++i) (*to)[i] = column.Get(row * static_cast<int>(kCount) + static_cast<int>(i));
}

// Returns whether each column that objects and instances have in common has the right number of entries for the number
// of ids. Every valid message of a dump satisfies this.
template <class Run, class Positions>
bool has_shared_columns(const Run& run, const Positions& positions) {
  const int rows = run.ids_size();
  return positions.size() == 3 * rows && run.rotations_size() == 4 * rows && run.layers_size() == rows &&
         run.groups_size() == rows && run.tags_size() == rows;
}

template <class Run, class Positions>
SceneThing shared_part(const Run& run, const Positions& positions, int row) {
  SceneThing thing;
  thing.id = run.ids(row);
  read(positions, row, &thing.at);
  read(run.rotations(), row, &thing.rotation);
  thing.layers = run.layers(row);
  thing.group = run.groups(row);
  thing.tag = run.tags(row);
  return thing;
}

bool has_shape_columns(const v1::Insert& run) {
  const int rows = run.ids_size();
  switch (run.shape_case()) {
    case v1::Insert::kPoint:
      return true;
    case v1::Insert::kBall:
      return run.ball().radii_size() == rows;
    case v1::Insert::kBox:
      return run.box().half_extents_size() == 3 * rows;
    case v1::Insert::kCapsule:
      return run.capsule().radii_size() == rows && run.capsule().half_axes_size() == 3 * rows;
    case v1::Insert::kCompound:
      return for_each_part(run.compound(), [](const PartRow&) {});
    case v1::Insert::SHAPE_NOT_SET:
      return false;
  }
  return false;
}

void read_shape(const v1::Insert& run, int row, SceneThing* thing) {
  if (run.has_ball()) {
    thing->kind = ThingKind::kBall;
    thing->radius = run.ball().radii(row);
  } else if (run.has_box()) {
    thing->kind = ThingKind::kBox;
    read(run.box().half_extents(), row, &thing->size);
  } else if (run.has_capsule()) {
    thing->kind = ThingKind::kCapsule;
    thing->radius = run.capsule().radii(row);
    read(run.capsule().half_axes(), row, &thing->size);
  } else if (run.has_compound()) {
    thing->kind = ThingKind::kCompound;
    thing->compound = &run.compound();
  }
}

}  // namespace

std::string shape_name(ThingKind kind) {
  switch (kind) {
    case ThingKind::kPoint:
      return "point";
    case ThingKind::kBall:
      return "ball";
    case ThingKind::kBox:
      return "box";
    case ThingKind::kCapsule:
      return "capsule";
    case ThingKind::kCompound:
      return "compound";
    case ThingKind::kInstance:
      return "";
  }
  return "";
}

absl::Status for_each_thing(const v1::DumpSceneResponse& message,
                            const std::function<absl::Status(const SceneThing&)>& take) {
  for (const v1::Insert& run : message.objects()) {
    if (!has_shared_columns(run, run.positions_f64()) || !has_shape_columns(run)) return damaged();
    for (int row = 0; row < run.ids_size(); ++row) {
      SceneThing thing = shared_part(run, run.positions_f64(), row);
      read_shape(run, row, &thing);
      RETURN_IF_ERROR(take(thing));
    }
  }
  for (const v1::Placement& run : message.instances()) {
    if (!has_shared_columns(run, run.translations()) || run.scales_size() != run.ids_size()) return damaged();
    for (int row = 0; row < run.ids_size(); ++row) {
      SceneThing thing = shared_part(run, run.translations(), row);
      thing.kind = ThingKind::kInstance;
      thing.mesh = run.mesh();
      thing.scale = run.scales(row);
      RETURN_IF_ERROR(take(thing));
    }
  }
  return absl::OkStatus();
}

bool is_among(Things things, ThingKind kind) {
  return things == Things::kAll || (things == Things::kInstances) == (kind == ThingKind::kInstance);
}

const std::vector<std::string>& thing_keys(Things things) {
  using Keys = std::vector<std::string>;
  static const auto& all = *new Keys{"kind",   "id",   "shape", "mesh",  "at",     "rotation", "scale",
                                     "radius", "half", "axis",  "parts", "layers", "group",    "tag"};
  static const auto& objects =
      *new Keys{"id", "shape", "at", "rotation", "radius", "half", "axis", "parts", "layers", "group", "tag"};
  static const auto& instances = *new Keys{"id", "mesh", "at", "rotation", "scale", "layers", "group", "tag"};
  switch (things) {
    case Things::kAll:
      return all;
    case Things::kObjects:
      return objects;
    case Things::kInstances:
      return instances;
  }
  return all;
}

Json thing_row(const SceneThing& thing, Things things) {
  const bool instance = thing.kind == ThingKind::kInstance;
  Json row = Json::object();
  if (things == Things::kAll) row["kind"] = instance ? "instance" : "object";
  row["id"] = id_json(thing.id);
  if (instance) {
    row["mesh"] = thing.mesh;
  } else {
    row["shape"] = shape_name(thing.kind);
  }
  row["at"] = doubles_json(thing.at);
  row["rotation"] = floats_json(thing.rotation);
  if (instance) row["scale"] = float_json(thing.scale);
  if (thing.kind == ThingKind::kBall || thing.kind == ThingKind::kCapsule) row["radius"] = float_json(thing.radius);
  if (thing.kind == ThingKind::kBox) row["half"] = floats_json(thing.size);
  if (thing.kind == ThingKind::kCapsule) row["axis"] = floats_json(thing.size);
  if (thing.compound != nullptr) row["parts"] = parts_json(*thing.compound);
  row["layers"] = thing.layers;
  row["group"] = id_json(thing.group);
  row["tag"] = id_json(thing.tag);
  return row;
}

}  // namespace locus::cli
