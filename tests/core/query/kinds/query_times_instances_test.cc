// Tests queries about the past of instances: they are found where they were, if they were there.
#include <gmock/gmock.h>

#include "tests/support/owned_block.h"
#include "tests/support/run_batch.h"
#include "tests/support/scene_fixture.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

SceneSpec ten_ticks() {
  SceneSpec spec;
  spec.history = {10, uint64_t{1} << 30};
  return spec;
}

// Wall 9 does not move. Door 7 is a triangle in the plane z = 5. It is closed, at the origin of x and y, until tick 1,
// and open, at x = 10, from tick 2 on. At tick 3 it is hidden and door 8 is placed; at tick 4 door 8 jumps to x = 30.
class PastInstancesTest : public SceneFixture {
 protected:
  PastInstancesTest() : SceneFixture(ten_ticks()) {}
  void SetUp() override {
    place(7, {0, 0, 5});
    place(9, {5, 0, 8});
    tick(1, {});
    tick(2, with(instances_to({7}, {10, 0, 5})));
    UpdateBatch hide;
    hide.instance_relabels.emplace_back().ids = columns_.ids({7});
    hide.instance_relabels[0].layers = columns_.words({0});
    tick(3, hide);
    place(8, {20, 0, 5});
    InstanceMoveColumns jump = instances_to({8}, {30, 0, 5});
    jump.teleport = true;
    tick(4, with(jump));
    tick(5, {});
  }
  void place(Id id, std::vector<double> at) {
    ASSERT_TRUE(scene_.change_instances(placing(placement({id}, std::move(at)))).ok());
  }
  void tick(uint64_t tick, UpdateBatch batch) {
    batch.tick = tick;
    apply(batch);
  }

  static OwnedBlock at(uint64_t tick, float fraction, decltype(QueryBlock::kind) kind, std::vector<float> points,
                       std::vector<float> sizes = {}) {
    OwnedBlock block;
    block.settings.kind = std::move(kind);
    block.points = std::move(points);
    block.sizes = std::move(sizes);
    block.as_of_ticks = {tick};
    block.as_of_fractions = {fraction};
    return block;
  }
  static OwnedBlock up(float x, uint64_t tick, float fraction = 0) {
    return at(tick, fraction, RayColumns{}, {x + 0.2f, 0.2f, 0}, {0, 0, 1});
  }
  std::vector<uint64_t> found(const OwnedBlock& block) const {
    const BlockResult result = run_block(*scene_.latest(), block);
    return {result.ids.begin(), result.ids.end()};
  }
};

TEST_F(PastInstancesTest, ARewoundRayIsStoppedByTheDoorThatWasClosedThen) {
  EXPECT_THAT(found(up(0, 1)), ElementsAre(7));
  EXPECT_THAT(found(up(0, 2)), ElementsAre(kNoId));
  EXPECT_THAT(found(up(10, 2)), ElementsAre(7));
  EXPECT_THAT(found(up(10, 1)), ElementsAre(kNoId));
  EXPECT_THAT(found(up(0, 5)), ElementsAre(kNoId));
}

TEST_F(PastInstancesTest, BetweenTwoTicksADoorIsOnItsWay) {
  EXPECT_THAT(found(up(5, 1, 0.5f)), ElementsAre(7));
  EXPECT_THAT(found(up(0, 1, 0.5f)), ElementsAre(kNoId));
  EXPECT_THAT(found(up(2.5f, 1, 0.25f)), ElementsAre(7));
}

TEST_F(PastInstancesTest, ADoorIsSeenWithTheLabelsThatItHad) {
  EXPECT_THAT(found(up(10, 2, 0.5f)), ElementsAre(7));
  EXPECT_THAT(found(up(10, 3)), ElementsAre(kNoId));
}

TEST_F(PastInstancesTest, ADoorIsAbsentBeforeItsPlacementAndDoesNotFollowAJump) {
  EXPECT_THAT(found(up(20, 2, 0.9f)), ElementsAre(kNoId));
  EXPECT_THAT(found(up(20, 3)), ElementsAre(8));
  EXPECT_THAT(found(up(20, 3, 0.9f)), ElementsAre(8));
  EXPECT_THAT(found(up(25, 3, 0.5f)), ElementsAre(kNoId));
  EXPECT_THAT(found(up(30, 4)), ElementsAre(8));
}

TEST_F(PastInstancesTest, RaysOfOneBlockHaveTimesOfTheirOwn) {
  OwnedBlock block = up(0, 1);
  block.points = {0.2f, 0.2f, 0, 0.2f, 0.2f, 0, 5.2f, 0.2f, 0, 10.2f, 0.2f, 0};
  block.sizes = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
  block.as_of_ticks = {1, 2, 1, 2};
  block.as_of_fractions = {0, 0, 0.5f, 0};
  const std::vector<uint64_t> expected = {7, kNoId, 7, 7};
  EXPECT_EQ(found(block), expected);
  block.settings.precision = Precision::kConservative;
  EXPECT_EQ(found(block), expected);
}

TEST_F(PastInstancesTest, EveryKindOfQuerySeesThePast) {
  EXPECT_THAT(found(at(1, 0.5f, BallColumns{}, {5.2f, 0.2f, 5}, {0.1f})), ElementsAre(7));
  EXPECT_THAT(found(at(2, 0, BallColumns{}, {5.2f, 0.2f, 5}, {0.1f})), IsEmpty());
  EXPECT_THAT(found(at(1, 0.5f, BoxColumns{}, {5.2f, 0.2f, 5}, {0.1f, 0.1f, 0.1f})), ElementsAre(7));
  OwnedBlock nearest = at(1, 0.5f, NearestColumns{{}, {}, 1}, {5.2f, 0.2f, 5.5f});
  nearest.extras = {1};
  EXPECT_THAT(found(nearest), ElementsAre(7));
  OwnedBlock lookup = at(1, 0.5f, LookupColumns{}, {});
  lookup.ids = {7};
  EXPECT_EQ(run_block(*scene_.latest(), lookup).positions, (std::vector<double>{5, 0, 5}));
  lookup.ids = {8};
  EXPECT_THAT(found(lookup), ElementsAre(kNoId));
  OwnedBlock anchored = at(1, 0.5f, RayColumns{}, {0.2f, 0.2f, -5}, {0, 0, 1});
  anchored.anchor_ids = {7};
  EXPECT_THAT(found(anchored), ElementsAre(9));
  anchored.as_of_ticks = {2};
  EXPECT_THAT(found(anchored), ElementsAre(kNoId));
}

TEST_F(PastInstancesTest, TooManyTimesOfMovingInstancesAreRefused) {
  std::vector<Id> many;
  for (Id id = 100; id < 4'100; ++id) many.push_back(id);
  ASSERT_TRUE(scene_.change_instances(placing(placement(many, {0, 90, 0}))).ok());
  tick(6, {});
  tick(7, with(instances_to(many, {0, 95, 0})));
  OwnedBlock block = up(0, 6);
  block.points.clear();
  block.sizes = {0, 0, 1};
  block.as_of_fractions.clear();
  for (int i = 0; i < 1'000; ++i) {
    block.points.insert(block.points.end(), {0.2f, 0.2f, 0});
    block.as_of_fractions.push_back(static_cast<float>(i) / 1'000);
  }
  QueryBatch batch;
  batch.blocks = {block.view()};
  const absl::Status status = run_batch(*scene_.latest(), batch, {}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr("too many different times"));
  for (float& fraction : block.as_of_fractions) fraction = fraction < 0.5f ? 0.25f : 0.75f;
  batch.blocks = {block.view()};
  EXPECT_TRUE(run_batch(*scene_.latest(), batch, {}).ok());
}

TEST_F(PastInstancesTest, TheHistoryCountsTheInstancesThatMoved) {
  std::vector<Id> many;
  for (Id id = 100; id < 2'100; ++id) many.push_back(id);
  ASSERT_TRUE(scene_.change_instances(placing(placement(many, {0, 90, 0}))).ok());
  tick(6, {});
  tick(7, {});
  const uint64_t resting = scene_.status().history_bytes;
  tick(8, with(instances_to(many, {0, 95, 0})));
  tick(9, {});
  EXPECT_GT(scene_.status().history_bytes, resting + many.size() * sizeof(Instance));
  tick(10, {});
  const uint64_t moved = scene_.status().history_bytes;
  tick(11, {});
  EXPECT_LT(scene_.status().history_bytes, moved + 100'000);
}

TEST_F(PastInstancesTest, TheHistoryForgetsTicksWithADeletedMesh) {
  StaticChange remove;
  remove.remove_ids = columns_.ids({7, 8, 9});
  ASSERT_TRUE(scene_.change_instances(remove).ok());
  tick(6, {});
  tick(7, {});
  ASSERT_LT(scene_.latest()->oldest_tick(), 5u);
  scene_.forget_mesh(mesh_.get());
  EXPECT_EQ(scene_.latest()->oldest_tick(), 5u);
}

}  // namespace
}  // namespace locus::test
