// Tests that queries miss no hit. Definition of a miss: let e be 2^-20 (|origin in mesh axes| + mesh extent). If a
// reference in long double hits a triangle at t, and the hit is at least e inside the triangle's edges, the query must
// report a hit at no more than t + e / |direction|. e and |direction| are lengths in mesh axes.
#include <gtest/gtest.h>

#include <optional>

#include "tests/support/adversarial_scenes.h"
#include "tests/support/generated_meshes.h"
#include "tests/support/proof/real_triangle.h"
#include "tests/support/real.h"
#include "tests/support/small_world.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

// Returns the t at which the ray hits the triangle at least `inset` away from its edges.
std::optional<Real> inner_hit(const RealRay& ray, const Triangle& triangle, Real inset) {
  const Vec3r corners[] = {to_real(triangle.a), to_real(triangle.b), to_real(triangle.c)};
  const Vec3r normal = cross(corners[1] - corners[0], corners[2] - corners[0]);
  const Real slope = dot(normal, ray.direction);
  if (slope == 0) return std::nullopt;
  const Real t = dot(normal, corners[0] - ray.origin) / slope;
  if (!(t >= 0)) return std::nullopt;
  const Vec3r point = ray.origin + ray.direction * t;
  for (int i = 0; i < 3; ++i) {
    const Vec3r edge = corners[(i + 1) % 3] - corners[i];
    const Vec3r inward = cross(normal, edge);
    if (!(dot(point - corners[i], inward) >= inset * length(inward))) return std::nullopt;
  }
  return t;
}

struct MissCount {
  uint64_t hits = 0;
  uint64_t misses = 0;
};

// Counts hits of the reference and misses of the query for the rays of `block`; `triangles` are the triangles of the
// scene's only instance.
MissCount count_misses(const SceneSnapshot& snapshot, const OwnedBlock& block, const std::vector<Triangle>& triangles) {
  const Instance& instance = *snapshot.statics->tree().values().begin();
  const Transform& transform = instance.transform;
  const Real extent = magnitude(instance.mesh->bounds());
  const BlockResult result = run_block(snapshot, block);
  MissCount counted;
  for (size_t i = 0; i < result.t.size(); ++i) {
    const auto column = [i](const std::vector<float>& c) { return Vec3d{c[3 * i], c[3 * i + 1], c[3 * i + 2]}; };
    const Vec3r from_translation =
        to_real(block.settings.frame + column(block.points)) - to_real(transform.translation);
    const auto to_mesh = [&](Vec3r v) { return turned_back(transform.quaternion, v) * (1 / Real{transform.scale}); };
    const RealRay ray = {to_mesh(from_translation), to_mesh(to_real(column(block.sizes)))};
    const Real e = 0x1p-20L * (length(ray.origin) + extent);
    std::optional<Real> nearest;
    for (const Triangle& triangle : triangles) {
      const std::optional<Real> t = inner_hit(ray, triangle, e);
      if (t && (!nearest || *t < *nearest)) nearest = t;
    }
    if (!nearest) continue;
    ++counted.hits;
    if (!(Real{result.t[i]} <= *nearest + e / length(ray.direction))) ++counted.misses;
  }
  return counted;
}

// Returns rays from points on and around the mesh towards points of its triangles; a few start far away. In a tenth of
// the rays, one component of the direction is then set to zero.
OwnedBlock rays_at(const std::vector<Triangle>& triangles, const Transform& transform, double size, Random& random,
                   uint64_t count) {
  OwnedBlock block = rays_along_x(RayMode::kFirst, {});
  block.sizes.clear();
  block.settings.frame = random.chance(0.5) ? transform.translation : Vec3d{};
  const auto at_triangle = [&] {
    const Triangle& triangle = random.pick(triangles);
    const double u = random.unit(), v = random.unit() * (1 - u);
    return to_double(triangle.a) * (1 - u - v) + to_double(triangle.b) * u + to_double(triangle.c) * v;
  };
  while (block.points.size() < 3 * count) {
    const double away = size * random.magnitude(-6, random.chance(0.1) ? 8 : 2);
    const Vec3d from = random.chance(0.2) ? at_triangle() : at_triangle() + random.unit_vector() * away;
    const Vec3d origin = transform.point_to_world(from);
    const Vec3d target = transform.point_to_world(at_triangle());
    Vec3f direction = to_float((target - origin) * random.magnitude(-12, 12));
    if (random.chance(0.1)) direction[static_cast<int>(random.below(3))] = 0;
    if (direction == Vec3f{}) continue;
    const Vec3f offset = to_float(origin - block.settings.frame);
    block.points.insert(block.points.end(), {offset.x, offset.y, offset.z});
    block.sizes.insert(block.sizes.end(), {direction.x, direction.y, direction.z});
  }
  return block;
}

std::vector<Triangle> slivers(uint64_t seed) {
  Random random(seed);
  std::vector<Triangle> triangles;
  for (uint32_t i = 0; i < 300; ++i) {
    const Vec3d a = random.vector(1), along = random.unit_vector() * random.magnitude(-2, 1);
    const Vec3d across = random.unit_vector() * random.magnitude(-17, -2);
    triangles.push_back({to_float(a), to_float(a + along), to_float(a + along * random.unit() + across), i});
  }
  return triangles;
}

void expect_no_miss(const std::vector<Triangle>& triangles, uint64_t rays, uint64_t seed) {
  Random random(seed);
  const StaticMeshPtr mesh = mesh_of(triangles);
  const double size = magnitude(mesh->bounds());
  MissCount sum;
  constexpr uint64_t kTransforms = 10;
  for (uint64_t i = 0; i < kTransforms; ++i) {
    PlacedMesh instance = placed(1, mesh, random.vector(i % 3 == 0 ? 0 : i % 3 == 1 ? 100 : 1e6));
    if (i % 4 != 0) instance.rotation = random.rotation();
    instance.scale = static_cast<float>(i % 2 == 0 ? 1 : random.magnitude(-10, 10));
    QueryWorld world;
    world.instances = {instance};
    const SnapshotPtr snapshot = snapshot_of(world);
    const Transform& transform = snapshot->statics->find(1)->transform;
    const uint64_t count = rays / kTransforms;
    const MissCount counted = count_misses(*snapshot, rays_at(triangles, transform, size, random, count), triangles);
    EXPECT_EQ(counted.misses, 0u) << "seed " << seed << ", transform " << i;
    sum.hits += counted.hits;
  }
  EXPECT_GT(sum.hits, rays / 10) << "too few rays hit to prove anything, seed " << seed;
  ::testing::Test::RecordProperty("reference_hits", std::to_string(sum.hits));
}

TEST(QueryReferenceTest, NoRayMissesABumpySphere) {
  expect_no_miss(bumpy_sphere(8, 0.2, 81), scaled_count(70'000), 81);
}

TEST(QueryReferenceTest, NoRayMissesACity) { expect_no_miss(box_city(5, 82), scaled_count(60'000), 82); }

TEST(QueryReferenceTest, NoRayMissesASliver) { expect_no_miss(slivers(83), scaled_count(60'000), 83); }

TEST(QueryReferenceTest, NoRayMissesTrianglesOfAdversarialScenes) {
  for (uint64_t seed = 0; seed < scaled_count(24); ++seed) {
    Random random(seed);
    std::vector<Triangle> triangles = make_scene<Triangle>(adversarial_scene(seed, random), random).values;
    number_in_order(triangles);
    MissCount sum;
    QueryWorld world;
    world.instances = {placed(1, mesh_of(triangles))};
    const SnapshotPtr snapshot = snapshot_of(world);
    const Aabbf bounds = world.instances[0].mesh->bounds();
    const double size = max_component(to_double(bounds.extent()));
    const OwnedBlock block = rays_at(triangles, snapshot->statics->find(1)->transform, size, random, 1'000);
    EXPECT_EQ(count_misses(*snapshot, block, triangles).misses, 0u) << "seed " << seed;
  }
}

}  // namespace
}  // namespace locus::test
