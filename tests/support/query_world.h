// Content of a scene as plain values, and functions that make a snapshot of this content. The content is inserted in a
// given or a shuffled order, and optionally after other content was inserted and removed. Used by tests of queries.
#ifndef LOCUS_TESTS_SUPPORT_QUERY_WORLD_H_
#define LOCUS_TESTS_SUPPORT_QUERY_WORLD_H_

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/scene/scene.h"
#include "tests/support/random.h"

namespace locus::test {

using StaticMeshPtr = std::shared_ptr<const StaticMesh>;

struct PlacedMesh {
  Id id = kNoId;
  Group group = 0;
  Tag tag = 0;
  Layers layers = kDefaultLayers;
  StaticMeshPtr mesh;
  Vec3d translation;
  Quaternion rotation;
  float scale = 1;
};

struct QueryWorld {
  std::string name;
  Winding winding = Winding::kCounterClockwise;
  std::vector<PlacedMesh> instances;
  std::vector<Object> objects;
  std::vector<CompoundPtr> compounds;  // owns the compounds of `objects`
};

// Makes a mesh in which the number of a triangle is its index in `triangles`.
inline StaticMeshPtr mesh_of(const std::vector<Triangle>& triangles) {
  std::vector<float> vertices;
  std::vector<uint32_t> indices;
  for (const Triangle& triangle : triangles) {
    for (const Vec3f vertex : {triangle.a, triangle.b, triangle.c}) {
      indices.push_back(static_cast<uint32_t>(vertices.size() / 3));
      vertices.insert(vertices.end(), {vertex.x, vertex.y, vertex.z});
    }
  }
  auto mesh = TriangleMesh::create(std::move(vertices), std::move(indices), {});
  LOCUS_CHECK(mesh.ok());
  auto built = StaticMesh::build("mesh", Sha256{}, *std::move(mesh));
  LOCUS_CHECK(built.ok());
  return *std::move(built);
}

namespace internal {

inline PlacementColumns columns_of(const PlacedMesh& placed) {
  return {placed.mesh,        {&placed.id, 1},     {&placed.translation.x, 3}, {&placed.rotation.x, 4},
          {&placed.scale, 1}, {&placed.layers, 1}, {&placed.group, 1},         {&placed.tag, 1}};
}

inline InsertColumns columns_of(const Object& object) {
  const Shape& shape = object.shape;
  InsertColumns columns;
  columns.ids = {&object.id, 1};
  columns.positions_f64 = {&shape.position.x, 3};
  columns.rotations = {&shape.rotation.x, 4};
  columns.kind = shape.kind;
  columns.radii = {&shape.radius, 1};
  columns.extents = {&shape.size.x, 3};
  columns.layers = {&object.layers, 1};
  columns.groups = {&object.group, 1};
  columns.tags = {&object.tag, 1};
  if (object.compound == nullptr) return columns;
  for (const Part& part : object.compound->parts())
    columns.parts.push_back({part.kind,
                             {&part.position.x, 3},
                             {&part.rotation.x, 4},
                             {&part.radius, 1},
                             {&part.size.x, 3},
                             {&part.layers, 1}});
  return columns;
}

inline void apply_whole(Scene& scene, UpdateBatch batch) {
  batch.all_or_nothing = true;
  const absl::StatusOr<UpdateAck> ack = scene.apply(batch);
  LOCUS_CHECK(ack.ok());
}

inline void place(Scene& scene, const std::vector<PlacedMesh>& instances) {
  StaticChange change;
  for (const PlacedMesh& placed : instances) change.place.push_back(columns_of(placed));
  LOCUS_CHECK(scene.change_instances(change).ok());
}

inline void insert(Scene& scene, const std::vector<Object>& objects) {
  UpdateBatch batch;
  for (const Object& object : objects) batch.inserts.push_back(columns_of(object));
  apply_whole(scene, batch);
}

// Inserts, moves and removes objects and instances that do not belong to `world`. The scene is empty again afterwards.
inline void live_through_history(Scene& scene, const QueryWorld& world, Random& random) {
  std::vector<Object> strangers = world.objects;
  for (Object& object : strangers) {
    object.id += uint64_t{1} << 40;
    object.shape.position = random.vector(100);
  }
  insert(scene, strangers);
  std::vector<PlacedMesh> visitors = world.instances;
  for (PlacedMesh& placed : visitors) placed.id += uint64_t{1} << 41;
  place(scene, visitors);
  UpdateBatch moves;
  std::vector<uint64_t> ids;
  for (Object& object : strangers) {
    object.shape.position = random.vector(1000);
    moves.moves.push_back({{&object.id, 1}, {}, {&object.shape.position.x, 3}, {}, false});
    ids.push_back(object.id);
  }
  apply_whole(scene, moves);
  UpdateBatch removal;
  removal.remove_ids = ids;
  apply_whole(scene, removal);
  std::vector<uint64_t> placed_ids;
  for (const PlacedMesh& placed : visitors) placed_ids.push_back(placed.id);
  StaticChange removed;
  removed.remove_ids = placed_ids;
  LOCUS_CHECK(scene.change_instances(removed).ok());
}

}  // namespace internal

// Returns the spec of a scene for `world`.
inline SceneSpec spec_of(const QueryWorld& world) {
  SceneSpec spec;
  spec.winding = world.winding;
  return spec;
}

// Makes a snapshot of a scene with the content of `world`. The snapshot borrows nothing.
inline SnapshotPtr snapshot_of(const QueryWorld& world) {
  Scene scene("world", spec_of(world), 1, StaticSet::empty());
  if (!world.instances.empty()) internal::place(scene, world.instances);
  if (!world.objects.empty()) internal::insert(scene, world.objects);
  return scene.latest();
}

// Makes a snapshot with the same content as snapshot_of(), but by a different history: first inserts and removes other
// content, then inserts this content in a different order and in several batches.
inline SnapshotPtr snapshot_after_history(QueryWorld world, Random& random) {
  Scene scene("world", spec_of(world), 1, StaticSet::empty());
  internal::live_through_history(scene, world, random);
  random.shuffle(world.instances);
  random.shuffle(world.objects);
  const auto half = static_cast<std::ptrdiff_t>(world.objects.size() / 2);
  internal::insert(scene, {world.objects.begin(), world.objects.begin() + half});
  for (const PlacedMesh& placed : world.instances) internal::place(scene, {placed});
  internal::insert(scene, {world.objects.begin() + half, world.objects.end()});
  return scene.latest();
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_QUERY_WORLD_H_
