// Sweeps through a small world: walls at x = 4 and x = 8, a ball at x = 6.
#include "core/query/kinds/sweep_query.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/small_world.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;

class SweepQueryTest : public ::testing::Test {
 protected:
  SweepQueryTest() {
    QueryWorld world;
    world.instances = {placed(100, wall_mesh(), {4, 0, 0}), placed(101, wall_mesh(), {8, 0, 0})};
    world.objects = {ball_object(1, {6, 0, 0}, 0.5f)};
    snapshot_ = snapshot_of(world);
    block_.points = {0, 0, 0};
    block_.sizes = {10, 0, 0};
    block_.extras = {0.25f};
    block_.settings.kind = SweepColumns{};
  }

  SweepColumns& columns() { return std::get<SweepColumns>(block_.settings.kind); }
  BlockResult ask() const { return run_block(*snapshot_, block_); }

  SnapshotPtr snapshot_;
  OwnedBlock block_;
};

TEST_F(SweepQueryTest, TheFirstContactIsWhereTheBallTouchesTheWall) {
  block_.settings.columns = {Column::kT, Column::kId, Column::kTriangle, Column::kNormal, Column::kPoint};
  const BlockResult result = ask();
  EXPECT_THAT(result.ids, ElementsAre(100u));
  EXPECT_THAT(result.triangles, ElementsAre(0u));
  EXPECT_THAT(result.t, ElementsAre(0.375f));
  EXPECT_THAT(result.normals, ElementsAre(-1, 0, 0));
  EXPECT_THAT(result.points, ElementsAre(4, 0, 0));
}

TEST_F(SweepQueryTest, AllContactsAreInTheOrderOfTheWay) {
  columns().mode = RayMode::kAll;
  const BlockResult result = ask();
  EXPECT_THAT(result.counts, ElementsAre(3u));
  EXPECT_THAT(result.ids, ElementsAre(100u, 1u, 101u));
  EXPECT_THAT(result.t, ElementsAre(0.375f, 0.525f, 0.775f));
}

TEST_F(SweepQueryTest, MoreContactsThanRequestedAreTruncated) {
  columns().mode = RayMode::kAll;
  block_.settings.max_results = 2;
  const BlockResult result = ask();
  EXPECT_THAT(result.ids, ElementsAre(100u, 1u));
  EXPECT_THAT(result.truncated, ElementsAre(0u));
}

TEST_F(SweepQueryTest, AnyContactIsOneByte) {
  columns().mode = RayMode::kAny;
  block_.points = {0, 0, 0, 0, 0, 20};
  block_.sizes = {10, 0, 0, 10, 0, 20};
  EXPECT_EQ(ask().hits, std::string("\1\0", 2));
}

TEST_F(SweepQueryTest, AMissHasNoIdAndZeroesElsewhere) {
  block_.sizes = {3, 0, 0};
  block_.settings.columns = {Column::kT, Column::kId, Column::kNormal, Column::kPoint};
  const BlockResult result = ask();
  EXPECT_THAT(result.ids, ElementsAre(0u));
  EXPECT_THAT(result.t, ElementsAre(std::numeric_limits<float>::infinity()));
  EXPECT_THAT(result.normals, ElementsAre(0, 0, 0));
  EXPECT_THAT(result.points, ElementsAre(0, 0, 0));
}

TEST_F(SweepQueryTest, FiltersAndSourceApply) {
  block_.settings.source = Source::kDynamic;
  EXPECT_THAT(ask().ids, ElementsAre(1u));
  block_.settings.source = Source::kBoth;
  block_.ignore_ids = {100};
  EXPECT_THAT(ask().ids, ElementsAre(1u));
  block_.masks = {0};
  EXPECT_THAT(ask().ids, ElementsAre(0u));
}

TEST_F(SweepQueryTest, AtStartSelectsWhatIsTouchedAtTheStart) {
  block_.points = {3.9f, 0, 0};
  EXPECT_THAT(ask().t, ElementsAre(0));
  columns().at_start = AtStart::kPass;
  EXPECT_THAT(ask().ids, ElementsAre(1u));
  columns().at_start = AtStart::kApproach;
  EXPECT_THAT(ask().ids, ElementsAre(100u));
  block_.points = {4.1f, 0, 0};  // starts behind the wall and moves away from it
  EXPECT_THAT(ask().ids, ElementsAre(1u));
}

TEST_F(SweepQueryTest, ACapsuleAndABoxTouchWithTheirOwnShape) {
  block_.half_axes = {1, 0, 0};
  EXPECT_THAT(ask().t, ElementsAre(0.275f));
  block_.half_axes.clear();
  block_.extras.clear();
  block_.half_extents = {0.5f, 1, 1};
  EXPECT_THAT(ask().t, ElementsAre(0.35f));
  block_.rotations = {0, 0, 0.70710678f, 0.70710678f};  // a quarter turn around z: the half extent along x becomes 1
  EXPECT_NEAR(ask().t[0], 0.3f, 1e-6f);
}

TEST_F(SweepQueryTest, AConservativeSweepMovesBoundsThroughBounds) {
  block_.settings.precision = Precision::kConservative;
  block_.settings.source = Source::kDynamic;
  // The mover passes the ball's centre at a distance of 0.7. The radii sum to 0.75, so the mover touches the ball, but
  // its bounds touch the ball's bounds earlier.
  block_.points = {0, 0.7f, 0};
  block_.sizes = {10, 0.7f, 0};
  block_.settings.columns = {Column::kT, Column::kId, Column::kNormal, Column::kPoint};
  const BlockResult result = ask();
  EXPECT_THAT(result.ids, ElementsAre(1u));
  EXPECT_FLOAT_EQ(result.t[0], 0.525f);
  EXPECT_THAT(result.normals, ElementsAre(0, 0, 0));
  block_.settings.precision = Precision::kExact;
  EXPECT_GT(ask().t[0], 0.55f);
}

}  // namespace
}  // namespace locus::test
