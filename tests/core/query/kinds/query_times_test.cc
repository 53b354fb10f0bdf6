// Tests how the times of queries are resolved, the errors for times outside the history, and the results of a batch
// with times.
#include "core/query/kinds/query_times.h"

#include <gmock/gmock.h>

#include "core/query/columns.h"
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

// Scene at tick 30 with one object: point 1 of group 4. It was at (t, 0, 0) at each tick t.
class QueryTimesTest : public SceneFixture {
 protected:
  QueryTimesTest() : SceneFixture(ten_ticks()) {}
  void SetUp() override {
    InsertColumns insert = points({1}, {0, 0, 0});
    insert.groups = columns_.ids({4});
    apply(with(insert));
    for (uint64_t tick = 1; tick <= 30; ++tick) {
      UpdateBatch batch = with(move_to({1}, {static_cast<float>(tick), 0, 0}));
      batch.tick = tick;
      apply(batch);
    }
  }

  static OwnedBlock where(std::vector<uint64_t> ticks, std::vector<float> fractions = {}) {
    OwnedBlock block;
    block.settings.kind = LookupColumns{};
    block.ids.assign(ticks.size(), 1);
    block.as_of_ticks = std::move(ticks);
    block.as_of_fractions = std::move(fractions);
    return block;
  }
  static std::vector<double> xs(const BlockResult& result) {
    std::vector<double> xs;
    for (size_t i = 0; i < result.positions.size(); i += 3) xs.push_back(result.positions[i]);
    return xs;
  }
  absl::Status refusal(const OwnedBlock& block) const {
    QueryBatch batch;
    batch.blocks = {block.view()};
    return run_batch(*scene_.latest(), batch, {}).status();
  }
};

TEST_F(QueryTimesTest, EachQueryHasItsOwnTime) {
  const BlockResult result = run_block(*scene_.latest(), where({20, 25, 30}, {0.5f, 0.25f, 0}));
  EXPECT_EQ(xs(result), (std::vector<double>{20.5, 25.25, 30}));
  EXPECT_EQ(result.resolved_ticks, (std::vector<uint64_t>{20, 25, 30}));
  EXPECT_EQ(result.resolved_fractions, (std::vector<float>{0.5f, 0.25f, 0}));
  EXPECT_TRUE(result.clamped.empty());
}

TEST_F(QueryTimesTest, OneTimeForAllQueriesIsReportedForEach) {
  OwnedBlock block = where({22});
  block.ids = {1, 1, 1};
  const BlockResult result = run_block(*scene_.latest(), block);
  EXPECT_EQ(xs(result), (std::vector<double>{22, 22, 22}));
  EXPECT_EQ(result.resolved_ticks, (std::vector<uint64_t>{22, 22, 22}));
}

TEST_F(QueryTimesTest, OneTickWithManyFractionsGivesOneTimePerQuery) {
  OwnedBlock block = where({22});
  block.ids = {1, 1};
  block.as_of_fractions = {0, 0.5f};
  EXPECT_EQ(xs(run_block(*scene_.latest(), block)), (std::vector<double>{22, 22.5}));
}

TEST_F(QueryTimesTest, WithoutAsOfTicksNoTimesAreReported) {
  OwnedBlock block = where({22});
  block.as_of_ticks.clear();
  const BlockResult result = run_block(*scene_.latest(), block);
  EXPECT_EQ(xs(result), std::vector<double>{30});
  EXPECT_TRUE(result.resolved_ticks.empty());
  EXPECT_TRUE(result.resolved_fractions.empty());
}

TEST_F(QueryTimesTest, ATimeOutsideTheHistoryRefusesTheBatchAndNamesTheRange) {
  const absl::Status status = refusal(where({25, 19}, {0, 0.75f}));
  expect_refusal(status, absl::StatusCode::kOutOfRange, Reason::kOutOfRange, "blocks[0].as_of_ticks", 1);
  EXPECT_NE(status.message().find("the recorded ticks are 20 to 30"), absl::string_view::npos) << status;
  expect_refusal(refusal(where({31})), absl::StatusCode::kOutOfRange, Reason::kOutOfRange, "blocks[0].as_of_ticks", 0);
  expect_refusal(refusal(where({30}, {0.5f})), absl::StatusCode::kOutOfRange, Reason::kOutOfRange,
                 "blocks[0].as_of_ticks", 0);
}

TEST_F(QueryTimesTest, AFutureTimeIsRefusedWithoutAdviceAboutHistory) {
  for (const OwnedBlock& block : {where({31}), where({30}, {0.5f})}) {
    const std::string message(refusal(block).message());
    EXPECT_NE(message.find("is in the future; the recorded ticks are 20 to 30. "), std::string::npos) << message;
    EXPECT_EQ(message.find("history"), std::string::npos) << message;
  }
}

TEST_F(QueryTimesTest, ClampingUsesTheNearestKeptTimeAndListsTheQuery) {
  OwnedBlock block = where({2, 25, 31}, {0.5f, 0.5f, 0.5f});
  block.settings.outside = OutsideHistory::kClamp;
  const BlockResult result = run_block(*scene_.latest(), block);
  EXPECT_EQ(xs(result), (std::vector<double>{20, 25.5, 30}));
  EXPECT_EQ(result.clamped, (std::vector<uint32_t>{0, 2}));
  EXPECT_EQ(result.resolved_fractions, (std::vector<float>{0, 0.5f, 0}));
}

TEST_F(QueryTimesTest, GroupsAreLookedUpAtTheTimeOfEachQuery) {
  OwnedBlock block = where({20, 20, 28, 20});
  block.ids.clear();
  block.groups = {4, 4, 4, 5};
  const BlockResult result = run_block(*scene_.latest(), block);
  EXPECT_EQ(result.counts, (std::vector<uint32_t>{1, 1, 1, 0}));
  EXPECT_EQ(xs(result), (std::vector<double>{20, 20, 28}));
}

TEST_F(QueryTimesTest, TimesCountTowardsTheReplySize) {
  OwnedBlock block = where({20});
  QueryBatch batch;
  batch.blocks = {block.view()};
  batch.max_reply_bytes = static_cast<uint32_t>(fixed_reply_bytes(batch));
  EXPECT_TRUE(check_batch(batch).ok());
  const uint64_t with_times = fixed_reply_bytes(batch);
  batch.blocks[0].as_of_ticks = {};
  EXPECT_LT(fixed_reply_bytes(batch), with_times);
}

// Tests of the explanation in the error message for a time outside the history.
class NotKeptTest : public SceneFixture {
 protected:
  // Moves the objects 1 to 100 at each tick from 1 to 30.
  static void live(Scene& scene) {
    Columns columns;
    std::vector<uint64_t> ids(100);
    for (size_t i = 0; i < ids.size(); ++i) ids[i] = i + 1;
    UpdateBatch batch;
    batch.upsert = true;
    for (uint64_t tick = 1; tick <= 30; ++tick) {
      InsertColumns insert;
      insert.ids = ids;
      insert.positions = columns.floats({static_cast<float>(tick), 0, 0});
      batch.inserts = {insert};
      batch.tick = tick;
      ASSERT_TRUE(scene.apply(batch).ok());
    }
  }
  static std::string refusal(const SceneSnapshot& snapshot, uint64_t tick) {
    OwnedBlock block;
    block.settings.kind = LookupColumns{};
    block.ids = {1};
    block.as_of_ticks = {tick};
    QueryBatch batch;
    batch.blocks = {block.view()};
    const absl::Status status = run_batch(snapshot, batch, {}).status();
    expect_refusal(status, absl::StatusCode::kOutOfRange, Reason::kOutOfRange, "blocks[0].as_of_ticks", 0);
    const std::string message(status.message());
    return message.substr(message.find(": ") + 2);  // part of the message after the field's name
  }
};

TEST_F(NotKeptTest, ASceneWithoutHistoryAdvisesHistoryTicks) {
  live(scene_);
  EXPECT_EQ(
      refusal(*scene_.latest(), 29),
      "tick 29 is too old; the recorded ticks are 30 to 30: the scene has no history. Query the current tick, clamp, "
      "or create the scene with history_ticks");
}

TEST_F(NotKeptTest, ATickBeyondHistoryTicksAdvisesMoreHistoryTicks) {
  Scene scene("scene", ten_ticks(), kEpoch, StaticSet::empty());
  live(scene);
  EXPECT_EQ(
      refusal(*scene.latest(), 19),
      "tick 19 is too old; the recorded ticks are 20 to 30: older ticks are beyond history_ticks. Query one of these "
      "ticks, clamp, or create the scene with a larger history_ticks");
}

TEST_F(NotKeptTest, ATickThatDidNotFitAdvisesMoreHistoryBytes) {
  SceneSpec spec;
  spec.history = {1000, 100'000};
  Scene scene("scene", spec, kEpoch, StaticSet::empty());
  live(scene);
  EXPECT_GT(scene.latest()->oldest_tick(), 1u);
  EXPECT_THAT(refusal(*scene.latest(), 1),
              ::testing::HasSubstr(": older ticks did not fit into history_bytes. Query one of these ticks, clamp, or "
                                   "create the scene with a larger history_bytes"));
}

TEST_F(NotKeptTest, ATickBeforeRestartTicksStaysOutsideTheHistory) {
  Scene scene("scene", ten_ticks(), kEpoch, StaticSet::empty());
  live(scene);
  UpdateBatch restart;
  restart.restart_ticks = true;
  restart.tick = 25;
  ASSERT_TRUE(scene.apply(restart).ok());
  EXPECT_EQ(
      refusal(*scene.latest(), 24),
      "tick 24 is too old; the recorded ticks are 25 to 25: the scene's ticks began there. Query one of these ticks, "
      "or clamp");
}

// Scene whose ball 7 is at the origin at the end of tick 1 and at (0, 5, 0) at the end of tick 2. Within tick 2, the
// ball first moves far away.
class FastMoverQueryTest : public SceneFixture {
 protected:
  FastMoverQueryTest() : SceneFixture(ten_ticks()) {}
  void SetUp() override {
    batch(1, with(balls({7}, {0.5f})));
    batch(2, with(move_to({7}, {100, 0, 0})));
  }
  void batch(uint64_t tick, UpdateBatch batch) {
    batch.tick = tick;
    apply(batch);
  }
  void end_by_move() {
    batch(2, with(move_to({7}, {0, 5, 0})));
    batch(3, {});
  }
  void end_by_upsert() {
    InsertColumns insert = balls({7}, {0.5f});
    insert.positions = columns_.floats({0, 5, 0});
    UpdateBatch upsert = with(insert);
    upsert.upsert = true;
    batch(2, upsert);
    batch(3, {});
  }

  // Returns a block of one query at the time half way between ticks 1 and 2, when the ball is at (0, 2.5, 0).
  static OwnedBlock half_way(decltype(QueryBlock::kind) kind, std::vector<float> points,
                             std::vector<float> sizes = {}) {
    OwnedBlock block;
    block.settings.kind = std::move(kind);
    block.points = std::move(points);
    block.sizes = std::move(sizes);
    block.as_of_ticks = {1};
    block.as_of_fractions = {0.5f};
    return block;
  }
  std::vector<uint64_t> found(const OwnedBlock& block) const {
    const BlockResult result = run_block(*scene_.latest(), block);
    return {result.ids.begin(), result.ids.end()};
  }
  // Expects that lookups, balls, boxes, rays and nearest queries find the ball at (0, 2.5, 0).
  void expect_found() const {
    const std::vector<uint64_t> ball = {7};
    OwnedBlock lookup = half_way(LookupColumns{}, {});
    lookup.ids = {7};
    EXPECT_EQ(run_block(*scene_.latest(), lookup).positions, (std::vector<double>{0, 2.5, 0}));
    EXPECT_EQ(found(half_way(BallColumns{}, {0, 2.5f, 0}, {0.1f})), ball);
    EXPECT_EQ(found(half_way(BoxColumns{}, {0, 2.5f, 0}, {0.1f, 0.1f, 0.1f})), ball);
    EXPECT_EQ(found(half_way(RayColumns{}, {-10, 2.5f, 0}, {1, 0, 0})), ball);
    OwnedBlock nearest = half_way(NearestColumns{{}, {}, 1}, {0, 2.5f, 0.75f});
    nearest.extras = {1};
    EXPECT_EQ(found(nearest), ball);
  }
};

TEST_F(FastMoverQueryTest, ABallThatCameBackByAMoveIsFoundOnItsWay) {
  end_by_move();
  expect_found();
}

TEST_F(FastMoverQueryTest, ABallThatCameBackByAnUpsertIsFoundOnItsWay) {
  end_by_upsert();
  expect_found();
}

TEST_F(FastMoverQueryTest, ABallThatCameBackIsFoundOnItsWayBeforeTheTickEnds) {
  batch(2, with(move_to({7}, {0, 5, 0})));
  expect_found();
}

TEST_F(FastMoverQueryTest, AnObjectReplacedUnderItsIdIsNotFoundOnItsWay) {
  batch(2, removing({7}));
  end_by_upsert();
  EXPECT_TRUE(found(half_way(BallColumns{}, {0, 2.5f, 0}, {0.1f})).empty());
  EXPECT_EQ(found(half_way(BallColumns{}, {0, 0, 0}, {0.1f})), std::vector<uint64_t>{7});
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

// Between the ticks 2 and 3 an instance was hidden, but none has moved; between 6 and 7 one has moved.
TEST_F(PastInstancesTest, InstancesOfTwoTicksAreComparedOncePerBatch) {
  tick(6, {});
  tick(7, with(instances_to({9}, {5, 3, 8})));
  for (const uint64_t begin : {2, 6}) {
    OwnedBlock block = up(0, begin);
    block.points.clear();
    block.sizes = {0, 0, 1};
    block.as_of_fractions.clear();
    for (int i = 0; i < 16; ++i) {
      block.points.insert(block.points.end(), {0.2f, 0.2f, 0});
      block.as_of_fractions.push_back(static_cast<float>(i) / 16);
    }
    InterpolationBudget budget(uint64_t{1} << 20);
    const auto scene = scene_.latest();
    const absl::StatusOr<QueryTimes> times = QueryTimes::resolve(*scene, block.view(), "blocks[0]", budget);
    ASSERT_TRUE(times.ok()) << times.status();
    EXPECT_EQ(budget.pairs(), 1u);
    EXPECT_EQ(budget.taken() != 0, begin == 6);
    for (size_t i = 1; i < 16; ++i) EXPECT_EQ(times->of(i).interpolates_statics(), begin == 6) << i;
    EXPECT_EQ(&times->of(3).statics() == &times->of(1).statics(), begin == 2);
  }
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
