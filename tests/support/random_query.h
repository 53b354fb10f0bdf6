// Random worlds of instances and objects, and random batches of queries about these worlds. Both are made from the
// sketches of adversarial_scenes.h and grid_scenes.h. So scenes that are difficult for one index are tested with all
// indexes together.
#ifndef LOCUS_TESTS_SUPPORT_RANDOM_QUERY_H_
#define LOCUS_TESTS_SUPPORT_RANDOM_QUERY_H_

#include <algorithm>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/generated_meshes.h"
#include "tests/support/grid_scenes.h"
#include "tests/support/owned_block.h"
#include "tests/support/query_world.h"
#include "tests/support/random_compound.h"
#include "tests/support/scene_sketch.h"
#include "tests/support/small_world.h"

namespace locus::test {

struct QueryScene {
  QueryWorld world;
  std::vector<OwnedBlock> blocks;
};

namespace internal {

inline Layers random_layers(Random& random) {
  constexpr Layers kLayers[] = {1, 1, 1, 2, 3, 0, 0x80000000u, 0xFFFFFFFFu};
  return random.pick(kLayers);
}

inline Tag random_tag(Random& random) {
  constexpr Tag kTags[] = {0, 1, 2, 3, Tag{1} << 63};
  return random.pick(kTags);
}

// Generates a placement: unchanged, or moved to `near` (sometimes up to a million units from `near` on each axis) and
// often rotated or scaled.
inline PlacedMesh random_placement(Vec3d near, Random& random) {
  PlacedMesh placed;
  if (random.chance(0.4)) return placed;
  placed.translation = near;
  if (random.chance(0.15)) placed.translation = near + random.vector(1e6);
  if (random.chance(0.6)) placed.rotation = random.rotation();
  if (random.chance(0.5)) placed.scale = static_cast<float>(random.magnitude(-10, 10));
  return placed;
}

// Returns `triangles` in mesh axes, so that the placement transforms them to their original positions. Coordinates
// beyond the limit of a mesh are clamped.
inline std::vector<Triangle> in_mesh_axes(const std::vector<Triangle>& triangles, const PlacedMesh& placed) {
  const Transform transform = make_transform(placed.translation, placed.rotation, placed.scale);
  constexpr Vec3d kEdge = {limits::kMaxCoordinate, limits::kMaxCoordinate, limits::kMaxCoordinate};
  const auto local = [&](Vec3f v) { return to_float(max(min(transform.point_to_mesh(to_double(v)), kEdge), -kEdge)); };
  std::vector<Triangle> result;
  for (const Triangle& t : triangles) result.push_back({local(t.a), local(t.b), local(t.c), t.number});
  return result;
}

inline void add_instances(const SceneSketch& sketch, Random& random, QueryWorld& world) {
  for (uint64_t meshes = random.below(3); meshes > 0; --meshes) {
    SceneSketch part{sketch.family, {}, {}, {}, {}};
    for (const Placement& placement : sketch.placements)
      if (random.chance(0.5)) part.placements.push_back(placement);
    const auto scene = make_scene<Triangle>(part, random);
    if (scene.values.empty()) continue;
    const PlacedMesh first = random_placement(sketch.placements[0].center, random);
    const StaticMeshPtr mesh = mesh_of(in_mesh_axes(scene.values, first));
    for (uint64_t copy = random.below(4); copy < 4; ++copy) {
      PlacedMesh placed = random.chance(0.4) ? random_placement(sketch.placements[0].center, random) : first;
      placed.mesh = mesh;
      if (random.chance(0.3)) placed.translation = placed.translation + random.whole_vector(2);
      if (max_component(abs(placed.translation)) <= limits::kMaxCoordinate) world.instances.push_back(placed);
    }
  }
  std::erase_if(world.instances, [](const PlacedMesh& placed) {
    const Transform transform = make_transform(placed.translation, placed.rotation, placed.scale);
    return magnitude(bounds_to_world(transform, placed.mesh->bounds())) > 1.9e9;
  });
}

// Adds instances of a closed mesh: a bumpy sphere, or a cube with corners on whole coordinates. Half of the meshes have
// a second, inverted shell of half or full size, so that the space within this shell is not inside the mesh.
inline void add_closed_meshes(const SceneSketch& sketch, Random& random, QueryWorld& world) {
  if (sketch.placements.empty() || random.chance(0.5)) return;
  std::vector<Triangle> shell;
  if (random.chance(0.5)) {
    shell = bumpy_sphere(4, 0.2, random.below(1000));
  } else {
    const StaticMeshPtr cube = cube_mesh();
    for (uint32_t number = 0; number < cube->triangle_count(); ++number) shell.push_back(cube->triangle(number));
  }
  if (random.chance(0.5)) {
    const size_t outer = shell.size();
    const float scale = random.chance(0.5) ? 0.5f : 1.0f;
    for (size_t i = 0; i < outer; ++i)
      shell.push_back({shell[i].a * scale, shell[i].c * scale, shell[i].b * scale, static_cast<uint32_t>(outer + i)});
  }
  const StaticMeshPtr mesh = mesh_of(shell);
  for (uint64_t copy = random.below(3); copy < 3; ++copy) {
    PlacedMesh placed;
    placed.mesh = mesh;
    placed.translation = random.pick(sketch.placements).center + random.whole_vector(2);
    if (random.chance(0.4)) placed.rotation = random.rotation();
    if (random.chance(0.5)) placed.scale = static_cast<float>(random.magnitude(-2, 5));
    if (max_component(abs(placed.translation)) <= limits::kMaxCoordinate / 2) world.instances.push_back(placed);
  }
}

inline void add_objects(const SceneSketch& sketch, Random& random, QueryWorld& world) {
  SceneSketch part{sketch.family, {}, {}, {}, {}};
  for (const Placement& placement : sketch.placements)
    if (max_component(placement.half) <= limits::kMaxCoordinate && random.chance(0.7))
      part.placements.push_back(placement);
  world.objects = make_scene<Object>(part, random).values;
}

// Assigns ids, groups, tags and layers to all instances and objects. The ids are from one shuffled range, and some have
// bit 63 set.
inline void label(Random& random, QueryWorld& world) {
  const std::vector<uint32_t> ids = shuffled_ids(world.instances.size() + world.objects.size(), random);
  size_t next = 0;
  const auto label_one = [&](auto& item) {
    const uint32_t number = ids[next++];
    item.id = number % 5 == 0 ? (Id{1} << 63) | number : number;
    item.group = random.below(4);
    item.tag = random.chance(0.5) ? random.next() : random_tag(random);
    item.layers = random_layers(random);
  };
  for (PlacedMesh& placed : world.instances) label_one(placed);
  for (Object& object : world.objects) label_one(object);
}

inline void append(std::vector<float>& column, Vec3f v) { column.insert(column.end(), {v.x, v.y, v.z}); }

// Appends `world`, a position in world coordinates, as an offset from the frame of the block. The position is clamped
// to the bounds of the world.
inline void append_point(OwnedBlock& block, Vec3d world) {
  Vec3d clamped = world;
  for (int axis = 0; axis < 3; ++axis)
    clamped[axis] = std::min(std::max(world[axis], -limits::kMaxCoordinate), limits::kMaxCoordinate);
  Vec3f offset = to_float(clamped - block.settings.frame);
  for (int axis = 0; axis < 3; ++axis)
    if (std::abs(block.settings.frame[axis] + double{offset[axis]}) > limits::kMaxCoordinate)
      offset[axis] = std::nextafter(offset[axis], 0.0f);
  append(block.points, offset);
}

// Sets anchors for the queries of some blocks: ids of objects and instances of the scene, and ids that may be unknown.
// The positions of the queries are then relative to their anchors.
inline void add_anchors(const QueryScene& scene, Random& random, OwnedBlock& block) {
  const BlockKind kind = block_kind(block.settings);
  const size_t n = query_count(block.view());
  if (n == 0 || kind == BlockKind::kLookup || kind == BlockKind::kPairs || random.chance(0.85)) return;
  for (size_t i = random.chance(0.2) ? 1 : n; i > 0; --i) {
    Id id = 1 + random.below(30);
    if (!scene.world.objects.empty() && random.chance(0.7)) id = random.pick(scene.world.objects).id;
    if (!scene.world.instances.empty() && random.chance(0.2)) id = random.pick(scene.world.instances).id;
    block.anchor_ids.push_back(id);
  }
  QueryBatch batch;
  batch.blocks = {block.view()};
  // Positions that are valid relative to the frame may be too large as offsets from an anchor.
  if (!check_batch(batch).ok()) block.anchor_ids.clear();
}

// Restricts the queries of some blocks to groups, tags, or everything but an object or instance of each query.
inline void add_rare_filters(const QueryScene& scene, Random& random, OwnedBlock& block) {
  const size_t n = query_count(block.view());
  const auto entries = [&] { return random.chance(0.5) ? n : size_t{1}; };
  if (random.chance(0.15)) {
    block.settings.only_groups_each = static_cast<uint32_t>(random.below(4));
    for (size_t i = entries() * block.settings.only_groups_per_query(); i > 0; --i)
      block.only_groups.push_back(random.below(5));
  }
  if (random.chance(0.15)) {
    constexpr uint64_t kTagMasks[] = {0, 1, 2, 3, uint64_t{1} << 63, ~uint64_t{0}};
    for (size_t i = entries(); i > 0; --i) block.tags.push_back(random_tag(random));
    if (!block.tags.empty() && random.chance(0.8))
      for (size_t i = entries(); i > 0; --i) block.tag_masks.push_back(random.pick(kTagMasks));
  }
  if (random.chance(0.8)) return;
  for (size_t i = entries(); i > 0; --i) {
    Id id = random.below(30);
    if (!scene.world.objects.empty() && random.chance(0.5)) id = random.pick(scene.world.objects).id;
    if (!scene.world.instances.empty() && random.chance(0.4)) id = random.pick(scene.world.instances).id;
    block.self_ids.push_back(id);
  }
}

inline void add_common(const QueryScene& scene, Random& random, OwnedBlock& block) {
  const size_t n = query_count(block.view());
  QueryBlock& settings = block.settings;
  settings.source = random.chance(0.6) ? Source::kBoth : random.chance(0.5) ? Source::kStatic : Source::kDynamic;
  settings.precision = random.chance(0.3) ? Precision::kConservative : Precision::kExact;
  if (random.chance(0.4)) settings.max_results = static_cast<uint32_t>(random.whole(1, 5));
  if (random.chance(0.15)) settings.after_id = random.below(20);
  const auto entries = [&] { return random.chance(0.5) ? n : size_t{1}; };
  if (random.chance(0.3))
    for (size_t i = entries(); i > 0; --i) block.masks.push_back(random_layers(random));
  if (random.chance(0.3))
    for (size_t i = entries(); i > 0; --i) block.ignore_groups.push_back(random.below(5));
  if (random.chance(0.2) && !scene.world.objects.empty())
    for (int i = 0; i < 3; ++i) block.ignore_ids.push_back(random.pick(scene.world.objects).id);
  add_rare_filters(scene, random, block);
  add_anchors(scene, random, block);
  const bool has_counts = row_layout(block.view()) == RowLayout::kCounted && block_kind(settings) != BlockKind::kCell;
  if (has_counts && random.chance(0.15)) settings.count_only = true;
}

// Sets random page positions in some blocks of rays or nearest queries: the results continue behind these positions.
inline void add_after(Random& random, OwnedBlock& block) {
  if (random.chance(0.7)) return;
  constexpr float kTs[] = {-1, 0, 0.5f, 1, 1, 2, 3, 5, std::numeric_limits<float>::infinity()};
  const size_t n = query_count(block.view());
  const auto entries = [&] { return random.chance(0.5) ? n : size_t{1}; };
  for (size_t i = entries(); i > 0; --i) block.after_ts.push_back(random.pick(kTs));
  if (random.chance(0.3)) return;
  for (size_t i = entries(); i > 0; --i) block.after_ids.push_back(random.below(20));
  if (random.chance(0.3)) return;
  for (size_t i = entries(); i > 0; --i) block.after_triangles.push_back(static_cast<uint32_t>(random.below(20)));
}

template <size_t kCount>
void add_columns(const Column (&served)[kCount], Random& random, OwnedBlock& block) {
  if (random.chance(0.3)) return;
  for (const Column column : served)
    if (random.chance(0.6)) block.settings.columns.add(column);
}

inline constexpr Column kRayColumns[] = {Column::kT,      Column::kId,    Column::kTriangle, Column::kUv,
                                         Column::kNormal, Column::kPoint, Column::kGroup,    Column::kTag,
                                         Column::kLayers, Column::kPose};
inline constexpr Column kSweepColumns[] = {Column::kT,      Column::kId,     Column::kTriangle,
                                           Column::kNormal, Column::kPoint,  Column::kGroup,
                                           Column::kTag,    Column::kLayers, Column::kPose};
inline constexpr Column kOverlapColumns[] = {Column::kId,  Column::kTriangle, Column::kGroup,
                                             Column::kTag, Column::kLayers,   Column::kPose};
inline constexpr Column kContactColumns[] = {Column::kT,      Column::kId,     Column::kTriangle,
                                             Column::kNormal, Column::kPoint,  Column::kGroup,
                                             Column::kTag,    Column::kLayers, Column::kPose};
inline constexpr Column kPairColumns[] = {Column::kT,   Column::kId,     Column::kOther, Column::kGroup,
                                          Column::kTag, Column::kLayers, Column::kPose};
inline constexpr Column kCellColumns[] = {Column::kT,      Column::kId,     Column::kTriangle,
                                          Column::kNormal, Column::kPoint,  Column::kGroup,
                                          Column::kTag,    Column::kLayers, Column::kPose};
inline constexpr Column kContainsColumns[] = {Column::kId, Column::kGroup, Column::kTag, Column::kLayers,
                                              Column::kPose};
inline constexpr Column kLookupColumns[] = {Column::kId, Column::kGroup, Column::kTag, Column::kLayers, Column::kPose};

inline OwnedBlock block_at(const SceneSketch& sketch, Random& random) {
  OwnedBlock block;
  if (random.chance(0.5)) block.settings.frame = notable_point(sketch, random);
  for (int axis = 0; axis < 3; ++axis) {
    double& x = block.settings.frame[axis];
    x = std::min(std::max(x, -limits::kMaxCoordinate), limits::kMaxCoordinate);
  }
  return block;
}

inline OwnedBlock ray_block(const QueryScene& scene, const SceneSketch& sketch, Random& random) {
  OwnedBlock block = block_at(sketch, random);
  constexpr RayMode kModes[] = {RayMode::kFirst, RayMode::kFirst, RayMode::kAny, RayMode::kAll};
  constexpr Cull kCulls[] = {Cull::kNone, Cull::kNone, Cull::kBack, Cull::kFront};
  constexpr Inside kInsides[] = {Inside::kSolid, Inside::kSolid, Inside::kHollow, Inside::kSkip};
  RayColumns rays;
  rays.mode = random.pick(kModes);
  rays.cull = random.pick(kCulls);
  rays.inside = random.pick(kInsides);
  block.settings.kind = rays;
  for (const Rayd& ray : sketch.rays) {
    const Vec3f direction = to_float(ray.direction);
    if (direction == Vec3f{} || !is_finite(direction)) continue;
    append_point(block, ray.origin);
    append(block.sizes, direction);
  }
  if (random.chance(0.2) && block.points.size() > 3) block.points.resize(3);  // one origin for all directions
  if (random.chance(0.2)) {
    const Quaternion q = random.chance(0.2) ? Quaternion{} : random.rotation();
    block.rotation = {q.x, q.y, q.z, q.w};
  }
  if (random.chance(0.4)) {
    constexpr float kEnds[] = {0, 1, 0.5f, 2, 3, 1e-3f, 1e30f, std::numeric_limits<float>::infinity()};
    for (size_t i = random.chance(0.5) ? 1 : query_count(block.view()); i > 0; --i)
      block.extras.push_back(random.pick(kEnds));
  }
  add_after(random, block);
  add_common(scene, random, block);
  if (rays.mode != RayMode::kAny) add_columns(kRayColumns, random, block);
  return block;
}

inline StaticDetail random_detail(Random& random) {
  constexpr StaticDetail kDetails[] = {StaticDetail::kInstances, StaticDetail::kTriangles,
                                       StaticDetail::kTrianglesSorted};
  return random.pick(kDetails);
}

inline OwnedBlock ball_block(const QueryScene& scene, const SceneSketch& sketch, Random& random) {
  OwnedBlock block = block_at(sketch, random);
  block.settings.kind = BallColumns{{}, {}, random_detail(random)};
  for (const Balld& ball : sketch.balls) {
    append_point(block, ball.center);
    block.sizes.push_back(static_cast<float>(std::min(ball.radius, 1e9)));
  }
  add_common(scene, random, block);
  add_columns(kContactColumns, random, block);
  return block;
}

inline OwnedBlock box_block(const QueryScene& scene, const SceneSketch& sketch, Random& random) {
  OwnedBlock block = block_at(sketch, random);
  block.settings.kind = BoxColumns{{}, {}, {}, random_detail(random)};
  const bool turned = random.chance(0.5);
  for (const Obbd& box : sketch.boxes) {
    append_point(block, box.center);
    append(block.sizes, to_float(min(box.half, Vec3d{1e9, 1e9, 1e9})));
    const Quaternion q = random.rotation();
    if (turned) block.extras.insert(block.extras.end(), {q.x, q.y, q.z, q.w});
  }
  add_common(scene, random, block);
  add_columns(kContactColumns, random, block);
  return block;
}

// Returns a block of capsules that start at the centres of the sketch's balls. Each ends at an offset with whole
// coordinates (which can be zero), at a short or long random offset, or at a notable point. Some radii are zero.
inline OwnedBlock capsule_block(const QueryScene& scene, const SceneSketch& sketch, Random& random) {
  OwnedBlock block = block_at(sketch, random);
  block.settings.kind = CapsuleColumns{{}, {}, {}, random_detail(random)};
  for (const Balld& ball : sketch.balls) {
    append_point(block, ball.center);
    Vec3d way = random.whole_vector(3);
    if (random.chance(0.3)) way = random.vector(random.magnitude(-5, 10));
    if (random.chance(0.2)) way = notable_point(sketch, random) - ball.center;
    const std::vector<float> starts = block.points;
    append_point(block, ball.center + way);
    block.sizes.insert(block.sizes.end(), block.points.end() - 3, block.points.end());
    block.points = starts;
    block.extras.push_back(random.chance(0.1) ? 0 : static_cast<float>(std::min(ball.radius, 1e9)));
  }
  add_common(scene, random, block);
  add_columns(kContactColumns, random, block);
  return block;
}

// Returns a block of sweeps by balls, capsules or boxes from the centres of the sketch's balls. Most move to a notable
// point or by an offset with whole coordinates; the others rest.
inline OwnedBlock sweep_block(const QueryScene& scene, const SceneSketch& sketch, Random& random) {
  OwnedBlock block = block_at(sketch, random);
  constexpr RayMode kModes[] = {RayMode::kFirst, RayMode::kFirst, RayMode::kAny, RayMode::kAll};
  constexpr AtStart kRules[] = {AtStart::kHit, AtStart::kApproach, AtStart::kPass};
  constexpr MoverKind kKinds[] = {MoverKind::kBall, MoverKind::kCapsule, MoverKind::kBox};
  SweepColumns sweeps;
  sweeps.mode = random.pick(kModes);
  sweeps.at_start = random.pick(kRules);
  block.settings.kind = sweeps;
  const MoverKind kind = random.pick(kKinds);
  const auto add = [&](Vec3d start, Vec3d end, double size) {
    append_point(block, start);
    const std::vector<float> starts = block.points;
    append_point(block, random.chance(0.1) ? start : end);
    block.sizes.insert(block.sizes.end(), block.points.end() - 3, block.points.end());
    block.points = starts;
    const auto length = static_cast<float>(std::clamp(size, 1e-6, 1e9));
    if (kind != MoverKind::kBox) block.extras.push_back(length);
    if (kind == MoverKind::kCapsule) append(block.half_axes, to_float(random.whole_vector(2) * double{length} * 0.5));
    if (kind == MoverKind::kBox) append(block.half_extents, Vec3f{length, random.chance(0.2) ? 0 : length, length / 2});
  };
  for (const Balld& ball : sketch.balls) {
    add(ball.center, random.chance(0.5) ? notable_point(sketch, random) : ball.center + random.whole_vector(4),
        random.chance(0.5) ? ball.radius : ball.radius * 0.125);
  }
  if (kind == MoverKind::kBox && random.chance(0.6)) {
    for (size_t i = random.chance(0.5) ? 1 : block.points.size() / 3; i > 0; --i) {
      const Quaternion q = random.rotation();
      block.rotations.insert(block.rotations.end(), {q.x, q.y, q.z, q.w});
    }
  }
  add_common(scene, random, block);
  if (sweeps.mode != RayMode::kAny) add_columns(kSweepColumns, random, block);
  return block;
}

inline OwnedBlock nearest_block(const QueryScene& scene, const SceneSketch& sketch, Random& random) {
  OwnedBlock block = block_at(sketch, random);
  constexpr uint32_t kCounts[] = {0, 1, 2, 5, 16, limits::kMaxNearest};
  block.settings.kind = NearestColumns{{}, {}, random.pick(kCounts), random_detail(random)};
  for (const Balld& ball : sketch.balls) append_point(block, ball.center);
  for (int i = 0; i < 3; ++i) append_point(block, notable_point(sketch, random));
  if (random.chance(0.5)) {
    constexpr float kEnds[] = {0, 0.5f, 1, 2, 5, 100, 1e9f, std::numeric_limits<float>::infinity()};
    for (size_t i = random.chance(0.5) ? 1 : block.points.size() / 3; i > 0; --i)
      block.extras.push_back(random.pick(kEnds));
  }
  add_after(random, block);
  add_common(scene, random, block);
  add_columns(kRayColumns, random, block);
  return block;
}

// Returns a block of convex regions around the sketch's balls: boxes, rotated and sheared boxes, and hulls of random
// planes. Some planes pass through notable points, and a few are replaced by planes without effect. Regions that
// check_batch() refuses, such as those without an interior point, are left out.
inline OwnedBlock frustum_block(const QueryScene& scene, const SceneSketch& sketch, Random& random) {
  OwnedBlock block = block_at(sketch, random);
  FrustumColumns frustums;
  constexpr uint32_t kPlanes[] = {0, 0, 4, 8, 12};
  frustums.planes_each = random.pick(kPlanes);
  frustums.detail = random_detail(random);
  block.settings.kind = frustums;
  for (const Balld& ball : sketch.balls) {
    const std::vector<float> before = block.points;
    const Vec3d center = ball.center - block.settings.frame;
    const Rotation rotation = random.chance(0.5) ? Rotation{} : rotation_of(random.rotation());
    for (size_t k = 0; k < frustums.planes_per_region(); ++k) {
      Vec3d normal;
      normal[static_cast<int>(k / 2 % 3)] = k % 2 == 0 ? 1 : -1;
      normal = rotation.to_world(normal);
      if (k >= 6 || random.chance(0.2)) normal = normal + random.vector(0.7);
      const Vec3d through = random.chance(0.2) ? notable_point(sketch, random) - block.settings.frame
                                               : center - normal * std::min(ball.radius, 1e9);
      const double length = random.chance(0.3) ? random.magnitude(-5, 5) : 1;
      append(block.points, to_float(normal * length));
      block.points.push_back(static_cast<float>(-dot(normal, through) * length));
      if (random.chance(0.05)) std::fill_n(block.points.end() - 4, 3, 0.0f), block.points.back() = 1;
    }
    const size_t n = query_count(block.view());
    const OwnedBlock last = block.part(n - 1, n);
    QueryBatch batch;
    batch.blocks = {last.view()};
    if (!check_batch(batch).ok()) block.points = before;
  }
  add_common(scene, random, block);
  add_columns(kOverlapColumns, random, block);
  return block;
}

// Returns a block of points: notable points, and points in, on and near the instances of closed meshes.
inline OwnedBlock contains_block(const QueryScene& scene, const SceneSketch& sketch, Random& random) {
  OwnedBlock block = block_at(sketch, random);
  block.settings.kind = ContainsColumns{};
  for (int i = 0; i < 4; ++i) append_point(block, notable_point(sketch, random));
  for (const PlacedMesh& placed : scene.world.instances) {
    if (!placed.mesh->is_closed()) continue;
    const Transform transform = make_transform(placed.translation, placed.rotation, placed.scale);
    const Triangle triangle = placed.mesh->triangle(static_cast<uint32_t>(random.below(placed.mesh->triangle_count())));
    Vec3d point = to_double(triangle.a);
    if (random.chance(0.7)) point = (point + to_double(triangle.b)) * 0.5;
    if (random.chance(0.5)) point = point * random.magnitude(-3, 1);
    append_point(block, transform.point_to_world(point));
  }
  add_common(scene, random, block);
  add_columns(kContainsColumns, random, block);
  return block;
}

// Returns a block of viewers and targets at and near notable points, sometimes with a viewer at a target's point, and
// often with groups that occur in the scene.
inline OwnedBlock sight_block(const QueryScene& scene, const SceneSketch& sketch, Random& random) {
  OwnedBlock block = block_at(sketch, random);
  SightColumns sight;
  sight.eyes = static_cast<uint32_t>(random.whole(0, 2));
  sight.samples = static_cast<uint32_t>(random.whole(0, 3));
  sight.pairwise = random.chance(0.3);
  block.settings.kind = sight;
  const size_t viewers = 1 + random.below(4),
               targets = sight.pairwise ? viewers : 1 + random.below(random.chance(0.1) ? 60 : 6);
  const auto add = [&](size_t points) {
    for (; points > 0; --points) {
      Vec3d point = notable_point(sketch, random);
      // Multiples of 1/8 are added without rounding error to whole coordinates, even to large ones.
      if (random.chance(0.6)) point = point + random.whole_vector(20) * 0.125;
      append_point(block, point);
    }
  };
  add(targets * sight.samples_per_target());
  block.sizes.swap(block.points);
  add(viewers * sight.eyes_per_viewer());
  if (random.chance(0.1)) std::copy_n(block.sizes.begin(), 3, block.points.begin());
  const auto random_groups = [&](size_t n) {
    std::vector<uint64_t> groups;
    if (random.chance(0.5))
      for (size_t i = random.chance(0.5) ? n : 1; i > 0; --i) groups.push_back(random.below(4));
    return groups;
  };
  block.groups = random_groups(viewers);
  block.target_groups = random_groups(targets);
  if (random.chance(0.3))
    for (size_t i = random.chance(0.5) ? 1 : viewers; i > 0; --i)
      block.extras.push_back(static_cast<float>(random.magnitude(-2, 10)));
  add_common(scene, random, block);
  return block;
}

// Returns a block that queries all pairs within a distance, or the nearest objects of each object. Some blocks query
// only objects of some layers, or only pairs behind a page position.
inline OwnedBlock pair_block(const QueryScene& scene, Random& random) {
  OwnedBlock block;
  PairColumns pairs;
  constexpr float kDistances[] = {0, 0, 0.5f, 1, 2, 5, 100, 1e9f};
  constexpr uint32_t kCounts[] = {0, 0, 1, 2, 7};
  pairs.max_distance = random.pick(kDistances);
  pairs.count = random.pick(kCounts);
  if (pairs.count != 0 && random.chance(0.3)) pairs.max_distance = std::numeric_limits<float>::infinity();
  if (random.chance(0.3)) pairs.first_mask = random_layers(random);
  if (random.chance(0.3)) pairs.second_mask = random_layers(random);
  block.settings.kind = pairs;
  add_common(scene, random, block);
  if (block.settings.after_id != kNoId && random.chance(0.5) && !scene.world.objects.empty())
    std::get<PairColumns>(block.settings.kind).after_other = random.pick(scene.world.objects).id;
  add_columns(kPairColumns, random, block);
  return block;
}

// Returns a block of cells around points at and near the centres of the sketch's balls.
inline OwnedBlock cell_block(const QueryScene& scene, const SceneSketch& sketch, Random& random) {
  OwnedBlock block = block_at(sketch, random);
  constexpr uint32_t kPlanes[] = {0, 0, 1, 3, 64};
  block.settings.kind = CellColumns{{}, {}, random.pick(kPlanes)};
  for (const Balld& ball : sketch.balls) {
    append_point(block, ball.center + random.whole_vector(4) * (random.chance(0.5) ? 0.5 : 0.0));
    block.extras.push_back(static_cast<float>(std::clamp(ball.radius * random.magnitude(-1, 6), 1e-3, 1e9)));
  }
  add_common(scene, random, block);
  add_columns(kCellColumns, random, block);
  return block;
}

inline OwnedBlock lookup_block(const QueryScene& scene, Random& random) {
  OwnedBlock block;
  block.settings.kind = LookupColumns{};
  if (random.chance(0.5)) {
    for (int i = 0; i < 3; ++i) block.groups.push_back(1 + random.below(4));
  } else {
    block.ids = {1 + random.below(100), 1 + random.below(10), (Id{1} << 63) | 5u};
  }
  add_common(scene, random, block);
  block.masks.clear();
  block.ignore_groups.clear();
  add_columns(kLookupColumns, random, block);
  return block;
}

// Turns some objects of some scenes into compounds of which the object's own shape is a part.
inline void add_compounds(Random& random, QueryWorld& world) {
  if (random.chance(0.6)) return;
  const double share = random.chance(0.3) ? 1 : 0.3;
  for (Object& object : world.objects) {
    if (object.shape.kind == ShapeKind::kPoint || !random.chance(share)) continue;
    world.compounds.push_back(compound_around(random, object.shape));
    object.compound = world.compounds.back().get();
    object.shape = {ShapeKind::kCompound, object.shape.position, object.shape.rotation, {}, 0};
  }
}

}  // namespace internal

inline QueryScene query_scene(const SceneSketch& sketch, Random& random) {
  QueryScene scene;
  scene.world.name = sketch.family;
  scene.world.winding = random.chance(0.3) ? Winding::kClockwise : Winding::kCounterClockwise;
  internal::add_instances(sketch, random, scene.world);
  internal::add_objects(sketch, random, scene.world);
  internal::add_closed_meshes(sketch, random, scene.world);
  internal::label(random, scene.world);
  for (int i = 0; i < 3; ++i) scene.blocks.push_back(internal::ray_block(scene, sketch, random));
  if (!sketch.balls.empty()) scene.blocks.push_back(internal::ball_block(scene, sketch, random));
  if (!sketch.boxes.empty()) scene.blocks.push_back(internal::box_block(scene, sketch, random));
  if (!sketch.placements.empty()) scene.blocks.push_back(internal::nearest_block(scene, sketch, random));
  scene.blocks.push_back(internal::lookup_block(scene, random));
  if (!sketch.balls.empty()) {
    scene.blocks.push_back(internal::capsule_block(scene, sketch, random));
    for (int i = 0; i < 2; ++i) scene.blocks.push_back(internal::sweep_block(scene, sketch, random));
  }
  if (!sketch.balls.empty()) scene.blocks.push_back(internal::frustum_block(scene, sketch, random));
  scene.blocks.push_back(internal::contains_block(scene, sketch, random));
  scene.blocks.push_back(internal::sight_block(scene, sketch, random));
  scene.blocks.push_back(internal::pair_block(scene, random));
  if (!sketch.balls.empty()) scene.blocks.push_back(internal::cell_block(scene, sketch, random));
  internal::add_compounds(random, scene.world);
  return scene;
}

inline SceneSketch random_sketch(uint64_t, Random& random) { return random_scene(random); }

// Generates the sketch of `seed`: from the families for grids if `seed` is a multiple of 3, otherwise from the
// adversarial families.
inline SceneSketch troublesome_sketch(uint64_t seed, Random& random) {
  return seed % 3 == 0 ? grid_scene(seed / 3, random) : adversarial_scene(seed, random);
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_RANDOM_QUERY_H_
