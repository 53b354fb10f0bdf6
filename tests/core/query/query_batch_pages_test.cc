// Pages of rays and nearest queries (AfterColumns), and queries that only count their rows, over random scenes and a
// small world.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/query/query_batch.h"
#include "tests/support/random_query.h"
#include "tests/support/small_world.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// Returns a world with three walls and a ball that all touch x = 4, and a wall at x = 9.
SnapshotPtr world_with_ties() {
  QueryWorld world;
  const StaticMeshPtr wall = wall_mesh();
  world.instances = {placed(5, wall, {4, 0, 0}), placed(6, mesh_of({wall_triangle(0), wall_triangle(0)}), {4, 0, 0}),
                     placed(7, wall, {9, 0, 0})};
  world.objects = {ball_object(2, {5, 0, 0})};
  return snapshot_of(world);
}

BlockResult hits_behind(float t, std::vector<uint64_t> ids, std::vector<uint32_t> triangles,
                        RayMode mode = RayMode::kAll) {
  OwnedBlock block = rays_along_x(mode);
  block.after_ts = {t};
  block.after_ids = std::move(ids);
  block.after_triangles = std::move(triangles);
  return run_block(*world_with_ties(), block);
}

TEST(QueryPagesTest, TiesAreContinuedByIdAndTriangle) {
  EXPECT_THAT(hits_behind(-1, {}, {}).ids, ElementsAre(2u, 5u, 6u, 6u, 7u));
  EXPECT_THAT(hits_behind(4, {2}, {kNoTriangle}).ids, ElementsAre(5u, 6u, 6u, 7u));
  const BlockResult result = hits_behind(4, {6}, {0});
  EXPECT_THAT(result.ids, ElementsAre(6u, 7u));
  EXPECT_THAT(result.triangles, ElementsAre(1u, 0u));
}

TEST(QueryPagesTest, WithoutAnIdHitsAtTheSameTAreLeftOut) { EXPECT_THAT(hits_behind(4, {}, {}).ids, ElementsAre(7u)); }

TEST(QueryPagesTest, FirstAndAnyContinueToo) {
  EXPECT_THAT(hits_behind(4, {5}, {}, RayMode::kFirst).ids, ElementsAre(6u));
  EXPECT_THAT(hits_behind(9, {}, {}, RayMode::kFirst).ids, ElementsAre(0u));
  EXPECT_EQ(hits_behind(4, {}, {}, RayMode::kAny).hits, std::string("\1", 1));
  EXPECT_EQ(hits_behind(9, {}, {}, RayMode::kAny).hits, std::string("\0", 1));
}

// Runs query `i` of a block repeatedly, for one page of `rows` rows at a time, and returns the rows of all pages.
BlockResult join_pages(const SceneSnapshot& snapshot, const OwnedBlock& block, size_t i, uint32_t rows) {
  BlockResult joined;
  OwnedBlock page = block.part(i, i + 1);
  if (auto* const nearest = std::get_if<NearestColumns>(&page.settings.kind))
    nearest->count = rows;
  else
    page.settings.max_results = rows;
  while (true) {
    const BlockResult result = run_block(snapshot, page);
    if (result.t.empty()) return joined;
    joined.t.insert(joined.t.end(), result.t.begin(), result.t.end());
    joined.ids.insert(joined.ids.end(), result.ids.begin(), result.ids.end());
    joined.triangles.insert(joined.triangles.end(), result.triangles.begin(), result.triangles.end());
    page.after_ts = {result.t.back()};
    page.after_ids = {result.ids.back()};
    page.after_triangles = {result.triangles.back()};
  }
}

bool has_pages(const OwnedBlock& block) {
  const auto* const rays = std::get_if<RayColumns>(&block.settings.kind);
  const auto* const nearest = std::get_if<NearestColumns>(&block.settings.kind);
  return (rays != nullptr && rays->mode == RayMode::kAll) || nearest != nullptr;
}

TEST(QueryPagesTest, JoinedPagesAreTheWholeAnswer) {
  size_t several = 0;
  for (uint64_t seed = 0; seed < scaled_count(300); ++seed) {
    Random random(seed);
    const QueryScene scene = query_scene(troublesome_sketch(seed, random), random);
    const SnapshotPtr snapshot = snapshot_of(scene.world);
    for (OwnedBlock block : scene.blocks) {
      if (!has_pages(block) || query_count(block.view()) == 0) continue;
      block.settings.columns = {Column::kT, Column::kId, Column::kTriangle};
      block.settings.count_only = false;
      block.settings.max_results = limits::kMaxMaxResults;
      if (auto* const nearest = std::get_if<NearestColumns>(&block.settings.kind)) nearest->count = limits::kMaxNearest;
      const size_t i = random.below(query_count(block.view()));
      const BlockResult whole = run_block(*snapshot, block.part(i, i + 1));
      ASSERT_THAT(whole.truncated, IsEmpty());
      const BlockResult pages = join_pages(*snapshot, block, i, static_cast<uint32_t>(random.whole(1, 3)));
      ASSERT_EQ(pages.t, whole.t) << scene.world.name << ", seed " << seed;
      ASSERT_EQ(pages.ids, whole.ids) << scene.world.name << ", seed " << seed;
      ASSERT_EQ(pages.triangles, whole.triangles) << scene.world.name << ", seed " << seed;
      several += whole.t.size() > 3 ? 1 : 0;
    }
  }
  EXPECT_GT(several, scaled_count(50));
}

OwnedBlock counting(OwnedBlock block) {
  block.settings.count_only = true;
  block.settings.max_results = 1;
  return block;
}

TEST(QueryCountsTest, CountsHaveNoRowsAndNoMaximum) {
  const SnapshotPtr snapshot = world_with_ties();
  BlockResult result = run_block(*snapshot, counting(rays_along_x(RayMode::kAll, {0, 0, 0, 0, 90, 0})));
  EXPECT_THAT(result.counts, ElementsAre(5u, 0u));
  EXPECT_THAT(result.t, IsEmpty());
  EXPECT_THAT(result.ids, IsEmpty());
  EXPECT_THAT(result.truncated, IsEmpty());
  OwnedBlock nearest = counting({});
  nearest.points = {0, 0, 0};
  nearest.extras = {4.5f};
  nearest.settings.kind = NearestColumns{{}, {}, 1, StaticDetail::kTriangles, {}};
  EXPECT_THAT(run_block(*snapshot, nearest).counts, ElementsAre(4u));
}

TEST(QueryCountsTest, OverlapsCountTrianglesOrInstances) {
  const SnapshotPtr snapshot = world_with_ties();
  OwnedBlock block = counting({});
  block.points = {4, 0, 0};
  block.sizes = {0.5f};
  block.settings.kind = BallColumns{{}, {}, StaticDetail::kTriangles};
  EXPECT_THAT(run_block(*snapshot, block).counts, ElementsAre(4u));
  block.settings.kind = BallColumns{{}, {}, StaticDetail::kInstances};
  EXPECT_THAT(run_block(*snapshot, block).counts, ElementsAre(3u));
  block.settings.after_id = 5;
  EXPECT_THAT(run_block(*snapshot, block).counts, ElementsAre(1u));
}

TEST(QueryCountsTest, ARayWithMoreHitsThanAKernelReturnsIsCountedWhole) {
  std::vector<Triangle> walls;
  for (uint32_t i = 0; i < 1000; ++i) walls.push_back(wall_triangle(static_cast<float>(i)));
  QueryWorld world;
  world.instances = {placed(1, mesh_of(walls))};
  EXPECT_THAT(run_block(*snapshot_of(world), counting(rays_along_x(RayMode::kAll, {-1, 0, 0}))).counts,
              ElementsAre(1000u));
}

}  // namespace
}  // namespace locus::test
