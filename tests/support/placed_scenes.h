// Random scenes in which the placement of meshes is the difficulty: far from the world's origin, with vertices far from
// the mesh's own origin, or rotated into planes of the world. The queries are mostly of those kinds whose conservative
// answers depend on the bounds of placed triangles.
#ifndef LOCUS_TESTS_SUPPORT_PLACED_SCENES_H_
#define LOCUS_TESTS_SUPPORT_PLACED_SCENES_H_

#include <vector>

#include "tests/support/random_query.h"

namespace locus::test {

using QueryKind = decltype(QueryBlock::kind);

namespace internal {

// Generates triangles, some in a plane perpendicular to an axis, so that their own bounds are flat.
inline StaticMeshPtr far_mesh(Random& random) {
  std::vector<Triangle> triangles;
  for (int i = random.whole(1, 6); i > 0; --i) {
    Triangle triangle{random.float_vector(3), random.float_vector(3), random.float_vector(3)};
    if (random.chance(0.4)) {
      const int axis = random.whole(0, 2);
      triangle.a[axis] = triangle.b[axis] = triangle.c[axis] = static_cast<float>(random.whole(-2, 2));
    }
    triangles.push_back(triangle);
  }
  return mesh_of(triangles);
}

inline PlacedMesh far_placement(Id id, Vec3d near, Random& random) {
  constexpr float kScales[] = {1, 1, 0x1p-20f, 1e3f};
  PlacedMesh placed;
  placed.id = id;
  placed.mesh = far_mesh(random);
  placed.translation = near;
  if (random.chance(0.5)) placed.rotation = random.rotation();
  placed.scale = random.pick(kScales);
  return placed;
}

inline OwnedBlock far_block(const PlacedMesh& placed, QueryKind kind, Random& random) {
  const double size = placed.scale;
  OwnedBlock block;
  block.settings.kind = std::move(kind);
  block.settings.frame = placed.translation;
  const bool of_rays = std::holds_alternative<RayColumns>(block.settings.kind);
  const bool of_balls = std::holds_alternative<BallColumns>(block.settings.kind);
  const bool of_boxes = std::holds_alternative<BoxColumns>(block.settings.kind);
  const bool turned = random.chance(0.5);
  for (int i = 0; i < 12; ++i) {
    const Vec3d at = random.vector((random.chance(0.2) ? 100 : 8) * size);
    append(block.points, to_float(at));
    if (of_rays)
      append(block.sizes, random.chance(0.3) ? to_float(random.whole_vector(1) + Vec3d{0.5, 0, 0})
                                             : to_float(random.vector(3 * size) - at));
    if (of_balls) block.sizes.push_back(random.float_between(0, 4 * size));
    if (of_boxes) append(block.sizes, to_float(random.positive_vector(3 * size)));
    const Quaternion q = random.rotation();
    if (of_boxes && turned) block.extras.insert(block.extras.end(), {q.x, q.y, q.z, q.w});
  }
  return block;
}

}  // namespace internal

// Generates small meshes, all near or all far from the world's origin, rotated and scaled, and queries around them
// without filters and limits. The scene has no objects.
inline QueryScene far_scene(Random& random) {
  constexpr double kDistances[] = {0, 1e3, 1e6, 1e6, 9e8};
  QueryScene scene;
  scene.world.name = "far placements";
  const double away = random.pick(kDistances);
  const Vec3d place = random.chance(0.3) ? Vec3d{away, 0, 0} : random.vector(away);
  for (Id id = 1; id <= 3; ++id)
    scene.world.instances.push_back(internal::far_placement(id, place + random.vector(5), random));
  for (const PlacedMesh& placed : scene.world.instances)
    for (const QueryKind& kind : {QueryKind(RayColumns{}), QueryKind(BallColumns{{}, {}, StaticDetail::kTriangles}),
                                  QueryKind(BoxColumns{{}, {}, {}, StaticDetail::kTriangles}),
                                  QueryKind(NearestColumns{{}, {}, 5, StaticDetail::kTriangles})})
      scene.blocks.push_back(internal::far_block(placed, kind, random));
  return scene;
}

// Generates a random scene and another mesh at the same position. The vertices of this mesh are about a million units
// from the mesh's own origin, and its translation moves them back. The transform to mesh axes rounds queries to floats
// at this large distance, while placed triangles are not rounded.
inline QueryScene brought_back_scene(Random& random) {
  SceneSketch sketch = random_scene(random);
  for (int i = 0; i < 40; ++i) sketch.balls.push_back({random.vector(5), random.between(0, 1)});
  for (int i = 0; i < 40; ++i) sketch.boxes.push_back({random.vector(5), random.positive_vector(1), {}});
  QueryScene scene = query_scene(sketch, random);
  PlacedMesh far;
  far.translation = random.vector(1e6);
  far.rotation = random.rotation();
  const auto triangles = make_scene<Triangle>(sketch, random).values;
  far.mesh = mesh_of(internal::in_mesh_axes(triangles, far));
  far.id = 1'000'000;
  scene.world.instances.push_back(far);
  return scene;
}

// Generates rays in the plane of a rotated floor, where the signs of edge functions are rounding noise.
inline QueryScene turned_floor_scene(Random& random) {
  QueryScene scene;
  scene.world.name = "turned floor";
  PlacedMesh floor;
  floor.id = 1;
  floor.rotation = random.rotation();
  const Transform transform = make_transform({}, floor.rotation, 1);
  std::vector<Triangle> triangles;  // horizontal in world axes, up to rounding
  const auto vertex = [&] {
    return to_float(transform.point_to_mesh({double(random.whole(-4, 4)), double(random.whole(-4, 4)), 1}));
  };
  for (uint32_t i = 0; i < 8; ++i) triangles.push_back({vertex(), vertex(), vertex(), i});
  floor.mesh = mesh_of(triangles);
  scene.world.instances.push_back(floor);
  OwnedBlock block;
  block.settings.kind = RayColumns{};
  for (int i = 0; i < 20; ++i) {
    internal::append(block.points, {float(random.whole(-8, 8)), float(random.whole(-8, 8)), 1});
    internal::append(block.sizes, {float(random.whole(1, 4)), float(random.whole(-4, 4)), 0});
  }
  scene.blocks = {block};
  return scene;
}

// Generates balls and boxes whose distance from a wall is zero or less than the resolution of float. Because of
// rounding, a test in mesh axes and a test in world axes find different balls and boxes that touch the wall.
inline QueryScene touching_scene(Random& random) {
  QueryScene scene;
  scene.world.name = "touching";
  PlacedMesh wall;
  wall.id = 1;
  wall.translation = random.vector(1);
  wall.scale = random.float_between(0.5, 2);
  const float x = random.float_between(-4, 4);
  wall.mesh = mesh_of({{{x, -50, -50}, {x, 50, -50}, {x, 0, 50}}});
  scene.world.instances.push_back(wall);
  OwnedBlock balls, boxes;
  balls.settings.kind = BallColumns{{}, {}, StaticDetail::kTriangles};
  boxes.settings.kind = BoxColumns{{}, {}, {}, StaticDetail::kTriangles};
  for (int i = 0; i < 20; ++i) {
    const Vec3f center = random.float_vector(5);
    const double gap = center.x - (wall.translation.x + double{wall.scale} * x);
    const auto size = static_cast<float>(std::abs(gap));
    for (OwnedBlock* block : {&balls, &boxes}) internal::append(block->points, center);
    balls.sizes.push_back(size);
    internal::append(boxes.sizes, {size, 1, 1});
  }
  scene.blocks = {balls, boxes};
  return scene;
}

// Generates rays that graze a triangle at the corner where the ray enters the triangle's bounds. At such a corner the
// rounding error of the t of the triangle is larger than that of the t of the bounds.
inline QueryScene grazing_scene(Random& random) {
  QueryScene scene;
  scene.world.name = "grazing";
  PlacedMesh placed;
  placed.id = 1;
  placed.rotation = random.rotation();
  // Move the mesh, whose vertices are far from its own origin, back to the world's origin.
  placed.translation = random.vector(1000);
  const Transform transform = make_transform(placed.translation, placed.rotation, 1);
  std::vector<Triangle> triangles;
  for (int i = 0; i < 20; ++i) {
    Triangle triangle;
    triangle.a = to_float(transform.point_to_mesh(random.vector(0.01)));
    triangle.b = to_float(transform.point_to_mesh({1, random.between(-1, -0.2), 0}));
    triangle.c = to_float(transform.point_to_mesh({1, 0.5, 0}));
    triangles.push_back(triangle);
    const Vec3d a = transform.point_to_world(to_double(triangle.a));
    const Vec3d ab = transform.point_to_world(to_double(triangle.b)) - a;
    const Vec3d ac = transform.point_to_world(to_double(triangle.c)) - a;
    const double slope = random.magnitude(-16, -13);
    const Vec3f direction = to_float((ab + ac) * 0.5 + normalized(cross(ab, ac)) * slope);
    OwnedBlock block;
    block.settings.kind = RayColumns{};
    block.settings.frame = a + (ab + ac) * random.magnitude(-45, -25);
    internal::append(block.points, direction * -static_cast<float>(std::exp2(random.whole(-12, 2))));
    internal::append(block.sizes, direction);
    scene.blocks.push_back(block);
  }
  placed.mesh = mesh_of(triangles);
  scene.world.instances.push_back(placed);
  return scene;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_PLACED_SCENES_H_
