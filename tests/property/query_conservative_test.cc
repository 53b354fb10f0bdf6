// CONSERVATIVE finds all that EXACT finds, no later along a ray and no farther from a point.
#include <gtest/gtest.h>

#include <map>
#include <utility>

#include "tests/support/random_query.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

using Found = std::map<std::pair<Id, uint32_t>, float>;  // t by id and triangle

std::vector<Found> found_by(const SceneSnapshot& snapshot, OwnedBlock block, Precision precision) {
  block.settings.precision = precision;
  block.settings.max_results = limits::kMaxMaxResults;
  block.settings.columns = {Column::kId, Column::kTriangle};
  if (auto* rays = std::get_if<RayColumns>(&block.settings.kind); rays != nullptr) {
    rays->mode = RayMode::kAll;
    block.settings.columns.add(Column::kT);
  }
  if (auto* nearest = std::get_if<NearestColumns>(&block.settings.kind); nearest != nullptr) {
    nearest->detail = StaticDetail::kTriangles;
    nearest->count = limits::kMaxNearest;
    block.settings.columns.add(Column::kT);
  }
  const BlockResult result = run_block(snapshot, block);
  EXPECT_TRUE(result.truncated.empty());
  std::vector<Found> found;
  size_t row = 0;
  for (const uint32_t rows : result.counts) {
    found.emplace_back();
    for (const size_t end = row + rows; row < end; ++row)
      found.back()[{result.ids[row], result.triangles[row]}] = result.t.empty() ? 0 : result.t[row];
  }
  return found;
}

std::string lacking(const Found& exact, const Found& conservative) {
  for (const auto& [key, t] : exact) {
    const auto other = conservative.find(key);
    const std::string what = "id " + std::to_string(key.first) + " triangle " + std::to_string(key.second);
    if (other == conservative.end()) return what + " is not found";
    if (!(other->second <= t))
      return what + " is found at " + std::to_string(other->second) + ", after " + std::to_string(t);
  }
  return "";
}

void expect_superset(const QueryScene& scene, uint64_t seed) {
  const SnapshotPtr snapshot = snapshot_of(scene.world);
  for (size_t b = 0; b + 1 < scene.blocks.size(); ++b) {
    const auto exact = found_by(*snapshot, scene.blocks[b], Precision::kExact);
    const auto conservative = found_by(*snapshot, scene.blocks[b], Precision::kConservative);
    for (size_t i = 0; i < exact.size(); ++i)
      ASSERT_EQ(lacking(exact[i], conservative[i]), "")
          << scene.world.name << ", seed " << seed << ", block " << b << ", query " << i;
  }
}

TEST(QueryConservativeTest, FindsAllThatExactFindsInRandomScenes) {
  for (uint64_t seed = 0; seed < scaled_count(1'500); ++seed) {
    Random random(seed);
    expect_superset(query_scene(random_scene(random), random), seed);
  }
}

TEST(QueryConservativeTest, FindsAllThatExactFindsInAdversarialScenes) {
  for (uint64_t seed = 0; seed < scaled_count(800); ++seed) {
    Random random(seed);
    expect_superset(query_scene(troublesome_sketch(seed, random), random), seed);
  }
}

// Vertices a million units from the mesh's origin, brought back by the translation: queries are rounded to the mesh's
// floats there, which the placed triangles know nothing of.
TEST(QueryConservativeTest, FindsAllThatExactFindsInMeshesFarFromTheirOwnOrigin) {
  for (uint64_t seed = 0; seed < scaled_count(400); ++seed) {
    Random random(seed);
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
    expect_superset(scene, seed);
  }
}

// In the plane of a turned floor, where the signs of edge functions are rounding noise.
TEST(QueryConservativeTest, FindsAllThatExactFindsInThePlaneOfTurnedTriangles) {
  for (uint64_t seed = 0; seed < scaled_count(1'000); ++seed) {
    Random random(seed);
    QueryScene scene;
    PlacedMesh floor;
    floor.id = 1;
    floor.rotation = random.rotation();
    const Transform transform = make_transform({}, floor.rotation, 1);
    std::vector<Triangle> triangles;  // level in the world, up to rounding
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
    scene.blocks = {block, OwnedBlock{}};
    expect_superset(scene, seed);
  }
}

}  // namespace
}  // namespace locus::test
