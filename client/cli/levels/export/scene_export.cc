#include "client/cli/levels/export/scene_export.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "client/cli/levels/export/unit_shapes.h"
#include "client/cli/rows/part_list.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

float drawn(float size) { return std::max(size, kMinDrawnSize); }

Json facts_of(const SceneThing& thing) {
  Json facts = {{"id", id_json(thing.id)}};
  if (thing.kind != ThingKind::kInstance) facts["shape"] = shape_name(thing.kind);
  if (thing.group != 0) facts["group"] = id_json(thing.group);
  if (thing.tag != 0) facts["tag"] = id_json(thing.tag);
  facts["layers"] = thing.layers;
  return facts;
}

// Returns the product of two quaternions: the rotation by `b` and then by `a`.
std::array<float, 4> product(const std::array<float, 4>& a, const std::array<float, 4>& b) {
  return {a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1], a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
          a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3], a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]};
}

std::array<float, 3> rotated(const std::array<float, 4>& rotation, const std::array<float, 3>& vector) {
  const std::array<float, 4> back = {-rotation[0], -rotation[1], -rotation[2], rotation[3]};
  const std::array<float, 4> result = product(product(rotation, {vector[0], vector[1], vector[2], 0}), back);
  return {result[0], result[1], result[2]};
}

std::string object_name(const SceneThing& thing) { return absl::StrCat("object ", thing.id); }

// Returns the shortest rotation from +z to the direction of `axis`. `length` is the length of `axis` and must not be 0.
std::array<float, 4> rotation_to(const std::array<float, 3>& axis, double length) {
  const double x = axis[0] / length;
  const double y = axis[1] / length;
  const double w = 1 + axis[2] / length;
  const double norm = std::sqrt(x * x + y * y + w * w);
  if (norm < 1e-6) return {1, 0, 0, 0};  // axis is -z: a half turn about x (any horizontal axis would do)
  return {static_cast<float>(-y / norm), static_cast<float>(x / norm), 0, static_cast<float>(w / norm)};
}

}  // namespace

std::array<double, 3> recentre_of(const std::array<double, 3>& min, const std::array<double, 3>& max) {
  constexpr double kFar = 8;
  std::array<double, 3> centre{};
  double distance = 0;
  double longest = 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    centre[axis] = std::round((min[axis] + max[axis]) / 2);
    distance = std::max(distance, std::abs(centre[axis]));
    longest = std::max(longest, max[axis] - min[axis]);
  }
  return distance > kFar * longest ? centre : std::array<double, 3>{};
}

GlbPlace SceneExport::place_of(const SceneThing& thing) const {
  GlbPlace place;
  for (size_t axis = 0; axis < 3; ++axis) {
    place.translation[axis] = static_cast<float>(thing.at[axis] - recentre_[axis]);
  }
  place.rotation = thing.rotation;
  return place;
}

absl::StatusOr<size_t> SceneExport::shape_mesh(Part part) {
  std::optional<size_t>& mesh_index = shape_meshes_[static_cast<size_t>(part)];
  if (mesh_index) return *mesh_index;
  ImportedMesh mesh;
  switch (part) {
    case Part::kMarker:
      mesh = unit_marker();
      break;
    case Part::kBall:
      mesh = unit_ball();
      break;
    case Part::kBox:
      mesh = unit_box();
      break;
    case Part::kDome:
      mesh = unit_dome();
      break;
    case Part::kTube:
    case Part::kCount:
      mesh = unit_tube();
      break;
  }
  mesh.parts = {{"objects", 0}};
  mesh_index = writer_.reserve_mesh();
  RETURN_IF_ERROR(writer_.set_mesh(*mesh_index, mesh));
  return *mesh_index;
}

absl::Status SceneExport::add_shape(const SceneThing& thing, Part part, const std::array<float, 3>& scale) {
  ASSIGN_OR_RETURN(const size_t mesh, shape_mesh(part));
  GlbPlace place = place_of(thing);
  place.scale = scale;
  return writer_.add_node(object_name(thing), place, mesh, facts_of(thing));
}

// Adds a capsule as a group of a tube and two domes. One mesh of a capsule would not be enough: scaling it to other
// proportions would deform its domes.
absl::Status SceneExport::add_capsule(const SceneThing& thing) {
  const std::array<float, 3>& axis = thing.size;
  const double length = std::sqrt(double{axis[0]} * axis[0] + double{axis[1]} * axis[1] + double{axis[2]} * axis[2]);
  const float radius = drawn(thing.radius);
  if (length == 0) return add_shape(thing, Part::kBall, {radius, radius, radius});
  ASSIGN_OR_RETURN(const size_t dome, shape_mesh(Part::kDome));
  ASSIGN_OR_RETURN(const size_t tube, shape_mesh(Part::kTube));
  const std::array<float, 3> back = {-axis[0], -axis[1], -axis[2]};
  const std::array<float, 4> forth_rotation = rotation_to(axis, length);
  const std::array<float, 3> round = {radius, radius, radius};
  return writer_.add_group(object_name(thing), place_of(thing),
                           {{tube, {{}, forth_rotation, {radius, radius, drawn(static_cast<float>(length))}}},
                            {dome, {axis, forth_rotation, round}},
                            {dome, {back, rotation_to(back, length), round}}},
                           facts_of(thing));
}

absl::Status SceneExport::add_instance(const SceneThing& thing) {
  const auto [entry, is_new] = mesh_numbers_.try_emplace(thing.mesh);
  if (is_new) {
    entry->second = writer_.reserve_mesh();
    mesh_names_.push_back(thing.mesh);
  }
  GlbPlace place = place_of(thing);
  place.scale.fill(thing.scale);
  return writer_.add_node(absl::StrCat("instance ", thing.id, " (", thing.mesh, ")"), place, entry->second,
                          facts_of(thing));
}

// Adds each part of a compound like an object of its shape.
absl::Status SceneExport::add_parts(const SceneThing& thing) {
  absl::Status added;
  for_each_part(*thing.compound, [&](const PartRow& row) {
    SceneThing part = thing;
    part.kind = row.shape == v1::Parts::kBall  ? ThingKind::kBall
                : row.shape == v1::Parts::kBox ? ThingKind::kBox
                                               : ThingKind::kCapsule;
    const std::array<float, 3> offset = rotated(thing.rotation, row.at);
    for (size_t axis = 0; axis < 3; ++axis) part.at[axis] += offset[axis];
    part.rotation = product(thing.rotation, row.rotation);
    part.radius = row.radius;
    part.size = row.size;
    if (added.ok()) added = add_drawn(part);
  });
  return added;
}

absl::Status SceneExport::add(const SceneThing& thing) {
  ++things_;
  return add_drawn(thing);
}

absl::Status SceneExport::add_drawn(const SceneThing& thing) {
  const float radius = drawn(thing.radius);
  switch (thing.kind) {
    case ThingKind::kPoint:
      return add_shape(thing, Part::kMarker, {kPointMarkSize, kPointMarkSize, kPointMarkSize});
    case ThingKind::kBall:
      return add_shape(thing, Part::kBall, {radius, radius, radius});
    case ThingKind::kBox:
      return add_shape(thing, Part::kBox, {drawn(thing.size[0]), drawn(thing.size[1]), drawn(thing.size[2])});
    case ThingKind::kCapsule:
      return add_capsule(thing);
    case ThingKind::kCompound:
      return add_parts(thing);
    case ThingKind::kInstance:
      return add_instance(thing);
  }
  return absl::OkStatus();
}

absl::Status SceneExport::set_mesh(const std::string& name, const ImportedMesh& mesh) {
  return writer_.set_mesh(mesh_numbers_.at(name), mesh);
}

}  // namespace locus::cli
