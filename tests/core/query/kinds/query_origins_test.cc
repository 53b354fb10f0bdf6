// Anchored queries in a small world: a ball at (10, 0, 0), another one at (13, 0, 0), and a wall at x = 20.
#include "core/query/kinds/query_origins.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/small_world.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class QueryOriginsTest : public ::testing::Test {
 protected:
  QueryOriginsTest() {
    QueryWorld world;
    world.objects = {ball_object(1, {10, 0, 0}), ball_object(2, {13, 0, 0})};
    world.instances = {placed(3, wall_mesh(), {20, 0, 0})};
    snapshot_ = snapshot_of(world);
  }
  // Returns a block of balls whose centres are given as offsets from anchors.
  static OwnedBlock balls(std::vector<uint64_t> anchors, std::vector<float> offsets, float radius) {
    OwnedBlock block;
    block.settings.kind = BallColumns{};
    block.points = std::move(offsets);
    block.sizes = {radius};
    block.anchor_ids = std::move(anchors);
    return block;
  }
  BlockResult ask(const OwnedBlock& block) const { return run_block(*snapshot_, block); }

  SnapshotPtr snapshot_;
};

TEST_F(QueryOriginsTest, PositionsCountFromTheAnchorWhichIsNotFound) {
  const BlockResult result = ask(balls({1, 2}, {0, 0, 0, 0, 0, 0}, 2.5f));
  EXPECT_THAT(result.counts, ElementsAre(1u, 1u));
  EXPECT_THAT(result.ids, ElementsAre(2u, 1u));
  EXPECT_THAT(result.unanchored, IsEmpty());
}

TEST_F(QueryOriginsTest, OneAnchorServesAllQueries) {
  const BlockResult result = ask(balls({1}, {0, 0, 0, 9.5f, 0, 0}, 2.5f));
  EXPECT_THAT(result.counts, ElementsAre(1u, 1u));
  EXPECT_THAT(result.ids, ElementsAre(2u, 3u));
  EXPECT_THAT(ask(balls({99}, {0, 0, 0, 1, 0, 0}, 1)).unanchored, ElementsAre(0u, 1u));
  EXPECT_THAT(ask(balls({1}, {1e9f, 0, 0, 0, 0, 0}, 1)).unanchored, ElementsAre(0u));
}

TEST_F(QueryOriginsTest, AnOffsetMovesTheQueryAwayFromItsAnchor) {
  EXPECT_THAT(ask(balls({1}, {9.5f, 0, 0}, 1)).ids, ElementsAre(3u));
}

TEST_F(QueryOriginsTest, TheFrameMovesNoAnchoredQueryButThePointsOfItsAnswer) {
  OwnedBlock block = rays_along_x(RayMode::kFirst);
  block.anchor_ids = {1};
  block.settings.frame = {4, 0, 0};
  block.settings.columns = {Column::kT, Column::kId, Column::kPoint};
  const BlockResult result = ask(block);
  EXPECT_THAT(result.ids, ElementsAre(2u));
  EXPECT_THAT(result.t, ElementsAre(2.0f));
  EXPECT_THAT(result.points, ElementsAre(8, 0, 0));
}

TEST_F(QueryOriginsTest, AnInstanceAnchorsItsTranslation) {
  EXPECT_THAT(ask(balls({3}, {-7, 0, 0}, 0.5f)).ids, ElementsAre(2u));
}

TEST_F(QueryOriginsTest, AnUnknownAnchorHasNoRowsAndIsListed) {
  const BlockResult result = ask(balls({1, 99, 2}, {0, 0, 0, 10, 0, 0, 0, 0, 0}, 2.5f));
  EXPECT_THAT(result.counts, ElementsAre(1u, 0u, 1u));
  EXPECT_THAT(result.unanchored, ElementsAre(1u));
}

TEST_F(QueryOriginsTest, AnUnknownAnchorOfARayIsAMiss) {
  OwnedBlock block = rays_along_x(RayMode::kFirst, {0, 0, 0, 0, 0, 0});
  block.anchor_ids = {99, 1};
  block.settings.columns = {Column::kT, Column::kId, Column::kNormal};
  const BlockResult result = ask(block);
  EXPECT_THAT(result.ids, ElementsAre(0u, 2u));
  EXPECT_THAT(result.normals, ElementsAre(0, 0, 0, -1, 0, 0));
  EXPECT_THAT(result.unanchored, ElementsAre(0u));
  std::get<RayColumns>(block.settings.kind).mode = RayMode::kAny;
  block.settings.columns = {};
  EXPECT_EQ(ask(block).hits, std::string("\0\1", 2));
}

TEST_F(QueryOriginsTest, APositionOutsideTheWorldIsUnanchored) {
  EXPECT_THAT(ask(balls({1, 1}, {1e9f, 0, 0, -1e9f, 0, 0}, 1)).unanchored, ElementsAre(0u));
}

TEST(QueryOriginsHistoryTest, TheAnchorIsWhereItWasAtTheTimeOfTheQuery) {
  SceneSpec spec;
  spec.history = {10, uint64_t{1} << 30};
  Scene scene("world", spec, 1, StaticSet::empty());
  const std::vector<Object> objects = {ball_object(1, {0, 0, 0}), ball_object(2, {100, 0, 0})};
  UpdateBatch inserts;
  for (const Object& object : objects) inserts.inserts.push_back(internal::columns_of(object));
  inserts.tick = 1;
  ASSERT_TRUE(scene.apply(inserts).ok());
  const uint64_t id = 1;
  const Vec3d to{98, 0, 0};
  UpdateBatch moves;
  moves.tick = 2;
  moves.moves.push_back({{&id, 1}, {}, {&to.x, 3}, {}, false});
  ASSERT_TRUE(scene.apply(moves).ok());
  OwnedBlock block;
  block.settings.kind = BallColumns{};
  block.points = {0, 0, 0, 0, 0, 0};
  block.sizes = {2};
  block.anchor_ids = {1, 1};
  block.as_of_ticks = {1, 2};
  EXPECT_THAT(run_block(*scene.latest(), block).counts, ElementsAre(0u, 1u));
  block.anchor_ids = {1};
  EXPECT_THAT(run_block(*scene.latest(), block).counts, ElementsAre(0u, 1u)) << "one anchor, two times";
}

}  // namespace
}  // namespace locus::test
