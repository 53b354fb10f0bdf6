// Tests the positions of objects at recorded ticks and between them, with insertions, removals, teleports and updates.
#include "core/scene/snapshot/scene_at_time.h"

#include <algorithm>

#include "tests/support/scene_fixture.h"

namespace locus::test {
namespace {

SceneSpec with_history() {
  SceneSpec spec;
  spec.history = {10, uint64_t{1} << 30};
  return spec;
}

class SceneAtTimeTest : public SceneFixture {
 protected:
  SceneAtTimeTest() : SceneFixture(with_history()) {}

  static UpdateBatch at_tick(uint64_t tick, UpdateBatch batch = {}) {
    batch.tick = tick;
    return batch;
  }
  static UpdateBatch jump(MoveColumns move) {
    move.teleport = true;
    return with(move);
  }

  // Returns the shape of object `id` at the given time, or nullopt if the object did not exist.
  std::optional<Shape> shape(Id id, uint64_t tick, float fraction = 0) const {
    const SnapshotPtr snapshot = scene_.latest();
    const std::optional<SceneAtTime> moment = find_scene_at(*snapshot, {tick, fraction});
    EXPECT_TRUE(moment) << tick << " is not kept";
    const GridRef object = moment->objects().find_ref(id);
    return object ? std::optional<Shape>(moment->shape(object)) : std::nullopt;
  }
  double x(Id id, uint64_t tick, float fraction = 0) const { return shape(id, tick, fraction).value().position.x; }
  bool is_kept(uint64_t tick, float fraction = 0) const {
    return find_scene_at(*scene_.latest(), {tick, fraction}).has_value();
  }
  std::vector<Id> found_near(Vec3d place, uint64_t tick, float fraction) const {
    const SnapshotPtr snapshot = scene_.latest();
    const SceneAtTime moment = find_scene_at(*snapshot, {tick, fraction}).value();
    std::vector<Id> found;
    Work work;
    const Aabbd bounds = {place, place};
    const auto ask = [&](const auto& visit) { moment.region(bounds, std::nullopt).visit(work, visit); };
    moment.visit_asked(bounds, work, ask, [&](const GridRef& object) {
      if (moment.shape(object).position == place) found.push_back(object.entry().id);
      return true;
    });
    return found;
  }
};

TEST_F(SceneAtTimeTest, NowIsTheSnapshotItself) {
  apply(at_tick(5, with(points({1}, {3, 0, 0}))));
  EXPECT_EQ(x(1, 5), 3);
}

TEST_F(SceneAtTimeTest, ATickShowsTheStateAtItsEnd) {
  apply(at_tick(1, with(points({1}, {1, 0, 0}))));
  apply(with(move_to({1}, {2, 0, 0})));
  apply(at_tick(2, with(move_to({1}, {3, 0, 0}))));
  EXPECT_EQ(x(1, 1), 2);
}

TEST_F(SceneAtTimeTest, BetweenTicksAnObjectIsOnTheStraightLine) {
  apply(at_tick(1, with(points({1}, {0, 0, 0}))));
  apply(at_tick(2, with(move_to({1}, {8, 4, 0}))));
  apply(at_tick(3, with(move_to({1}, {8, 8, 0}))));
  EXPECT_EQ(shape(1, 1, 0.25f)->position, (Vec3d{2, 1, 0}));
  EXPECT_EQ(shape(1, 2, 0.5f)->position, (Vec3d{8, 6, 0}));
}

TEST_F(SceneAtTimeTest, SkippedTicksAreInterpolatedBetweenTheirNeighbours) {
  apply(at_tick(10, with(points({1}, {0, 0, 0}))));
  apply(at_tick(14, with(move_to({1}, {8, 0, 0}))));
  EXPECT_EQ(x(1, 11), 2);
  EXPECT_EQ(x(1, 12, 0.5f), 5);
}

TEST_F(SceneAtTimeTest, RotationsFollowTheShorterArc) {
  InsertColumns insert = points({1}, {0, 0, 0});
  insert.rotations = columns_.floats({0, 0, 0, 1});
  apply(at_tick(1, with(insert)));
  MoveColumns turn = move_to({1}, {0, 0, 0});
  turn.rotations = columns_.floats({0, 0, -0.70710678f, -0.70710678f});  // a quarter turn, with the negated quaternion
  apply(at_tick(2, with(turn)));
  const Quaternion half = shape(1, 1, 0.5f)->rotation;
  EXPECT_NEAR(half.z, 0.38268343f, 1e-6);
  EXPECT_NEAR(half.w, 0.92387953f, 1e-6);
}

TEST_F(SceneAtTimeTest, AnObjectInsertedBetweenTicksIsAbsentBefore) {
  apply(at_tick(1, with(points({1}, {0, 0, 0}))));
  apply(at_tick(2, with(points({2}, {5, 0, 0}))));
  EXPECT_EQ(shape(2, 1, 0.9f), std::nullopt);
  EXPECT_EQ(x(2, 2), 5);
}

TEST_F(SceneAtTimeTest, AnObjectRemovedBetweenTicksStaysAtItsLastPosition) {
  apply(at_tick(1, with(points({1}, {4, 0, 0}))));
  apply(at_tick(2, removing({1})));
  EXPECT_EQ(x(1, 1, 0.9f), 4);
  EXPECT_EQ(shape(1, 2), std::nullopt);
}

TEST_F(SceneAtTimeTest, ATeleportedObjectStaysAtItsOldPositionUntilTheTick) {
  apply(at_tick(1, with(points({1}, {4, 0, 0}))));
  apply(at_tick(2, jump(move_to({1}, {100, 0, 0}))));
  apply(at_tick(3, with(move_to({1}, {102, 0, 0}))));
  EXPECT_EQ(x(1, 1, 0.9f), 4);
  EXPECT_EQ(x(1, 2), 100);
  EXPECT_EQ(x(1, 2, 0.5f), 101);
}

TEST_F(SceneAtTimeTest, AnIdRemovedAndInsertedInOneBatchBeginsANewLifetime) {
  apply(at_tick(1, with(points({1}, {4, 0, 0}))));
  UpdateBatch batch = with(points({1}, {8, 0, 0}));
  batch.remove_ids = columns_.ids({1});
  apply(at_tick(2, batch));
  EXPECT_EQ(x(1, 1, 0.5f), 4);
  EXPECT_EQ(x(1, 2), 8);
}

TEST_F(SceneAtTimeTest, ANewLifetimeAtTheSamePositionIsARevision) {
  apply(at_tick(1, with(points({1}, {4, 0, 0}))));
  UpdateBatch batch = with(points({1}, {4, 0, 0}));
  batch.remove_ids = columns_.ids({1});
  const uint64_t before = revision();
  EXPECT_EQ(apply(batch).revision, before + 1);
}

TEST_F(SceneAtTimeTest, AnUpsertContinuesTheLifetimeAndItsShapeCountsFromItsTickOn) {
  apply(at_tick(1, with(balls({1}, {1}))));
  InsertColumns other = balls({1}, {3});
  other.positions = columns_.floats({8, 0, 0});
  UpdateBatch batch = with(other);
  batch.upsert = true;
  apply(at_tick(2, batch));
  EXPECT_EQ(x(1, 1, 0.5f), 4);
  EXPECT_EQ(shape(1, 1, 0.5f)->radius, 1);
}

TEST_F(SceneAtTimeTest, AnUpsertWithoutRotationIsInterpolatedToTheIdentity) {
  InsertColumns turned = points({1}, {0, 0, 0});
  turned.rotations = columns_.floats({0, 0, 0.70710678f, 0.70710678f});
  apply(at_tick(1, with(turned)));
  UpdateBatch batch = with(points({1}, {0, 0, 0}));
  batch.upsert = true;
  apply(at_tick(2, batch));
  EXPECT_NEAR((shape(1, 1, 0.5f)->rotation.z), 0.38268343f, 1e-6);
  EXPECT_EQ(shape(1, 2)->rotation, Quaternion());
}

TEST_F(SceneAtTimeTest, AnUpsertShowsItsLabelsFromItsTickOn) {
  apply(at_tick(1, with(points({1}, {0, 0, 0}))));
  InsertColumns other = points({1}, {8, 0, 0});
  other.tags = columns_.ids({9});
  UpdateBatch batch = with(other);
  batch.upsert = true;
  apply(at_tick(2, batch));
  const SnapshotPtr snapshot = scene_.latest();
  EXPECT_EQ(find_scene_at(*snapshot, {1, 0.5f})->objects().find_ref(1).entry().tag, 0u);
  EXPECT_EQ(find_scene_at(*snapshot, {2, 0})->objects().find_ref(1).entry().tag, 9u);
}

TEST_F(SceneAtTimeTest, AnUpsertAfterARemoveInItsBatchBeginsANewLifetime) {
  apply(at_tick(1, with(points({1}, {4, 0, 0}))));
  UpdateBatch batch = with(points({1}, {8, 0, 0}));
  batch.remove_ids = columns_.ids({1});
  batch.upsert = true;
  apply(at_tick(2, batch));
  EXPECT_EQ(x(1, 1, 0.5f), 4);
  EXPECT_EQ(x(1, 2), 8);
}

TEST_F(SceneAtTimeTest, AnUpsertAfterARemoveInAnEarlierBatchOfTheTickBeginsANewLifetime) {
  apply(at_tick(1, with(points({1}, {4, 0, 0}))));
  apply(at_tick(2, removing({1})));
  UpdateBatch batch = with(points({1}, {8, 0, 0}));
  batch.upsert = true;
  apply(at_tick(2, batch));
  EXPECT_EQ(x(1, 1, 0.5f), 4);
  EXPECT_EQ(x(1, 2), 8);
}

TEST_F(SceneAtTimeTest, AnUpsertInABatchThatClearsBeginsANewLifetime) {
  apply(at_tick(1, with(points({1}, {4, 0, 0}))));
  UpdateBatch batch = with(points({1}, {8, 0, 0}));
  batch.clear = true;
  batch.upsert = true;
  apply(at_tick(2, batch));
  EXPECT_EQ(x(1, 1, 0.5f), 4);
  EXPECT_EQ(x(1, 2), 8);
}

TEST_F(SceneAtTimeTest, AnUpsertTeleportedInItsBatchBeginsANewLifetime) {
  apply(at_tick(1, with(points({1}, {4, 0, 0}))));
  UpdateBatch batch = jump(move_to({1}, {12, 0, 0}));
  batch.inserts = {points({1}, {8, 0, 0})};
  batch.upsert = true;
  apply(at_tick(2, batch));
  EXPECT_EQ(x(1, 1, 0.5f), 4);
  EXPECT_EQ(x(1, 2), 12);
}

TEST_F(SceneAtTimeTest, AReusedHandleIsNotTakenForTheOldLifetime) {
  apply(at_tick(1, with(points({1}, {4, 0, 0}))));
  apply(at_tick(2, removing({1})));
  apply(with(points({2}, {50, 0, 0})));
  apply(at_tick(3, with(points({3}, {60, 0, 0}))));
  EXPECT_EQ(x(1, 1, 0.5f), 4);
}

TEST_F(SceneAtTimeTest, LabelsAreThoseOfTheTick) {
  InsertColumns insert = points({1}, {0, 0, 0});
  insert.tags = columns_.ids({7});
  apply(at_tick(1, with(insert)));
  RelabelColumns relabel;
  relabel.ids = columns_.ids({1});
  relabel.tags = columns_.ids({8});
  apply(at_tick(2, with(relabel)));
  const SnapshotPtr snapshot = scene_.latest();
  EXPECT_EQ(find_scene_at(*snapshot, {1, 0.5f})->objects().find_ref(1).entry().tag, 7u);
  EXPECT_EQ(find_scene_at(*snapshot, {2, 0})->objects().find_ref(1).entry().tag, 8u);
}

TEST_F(SceneAtTimeTest, ASearchFindsObjectsThatMoveThroughItsRegion) {
  apply(at_tick(1, with(points({1, 2}, {0, 0, 0, 3, 0, 0}))));
  apply(at_tick(2, with(move_to({1, 2}, {1, 0, 0, 3, 4, 0}))));
  EXPECT_EQ(found_near({0.5, 0, 0}, 1, 0.5f), std::vector<Id>{1});
  EXPECT_EQ(found_near({3, 2, 0}, 1, 0.5f), std::vector<Id>{2});
}

TEST_F(SceneAtTimeTest, ASearchFindsFastMovers) {
  apply(at_tick(1, with(points({1, 2}, {0, 0, 0, 3, 0, 0}))));
  apply(at_tick(2, with(move_to({1, 2}, {100000, 0, 0, 3, 1, 0}))));
  EXPECT_EQ(found_near({50000, 0, 0}, 1, 0.5f), std::vector<Id>{1});
}

TEST_F(SceneAtTimeTest, ASearchVisitsEachObjectOnce) {
  apply(at_tick(1, with(points({1}, {0, 0, 0}))));
  apply(at_tick(2, with(move_to({1}, {20, 0, 0}))));
  EXPECT_EQ(found_near({10, 0, 0}, 1, 0.5f), std::vector<Id>{1});
}

TEST_F(SceneAtTimeTest, FutureTimesAndDroppedTicksHaveNoView) {
  for (uint64_t tick = 1; tick <= 30; ++tick) apply(at_tick(tick));
  EXPECT_TRUE(is_kept(20));
  EXPECT_TRUE(is_kept(30));
  EXPECT_FALSE(is_kept(19, 0.9f));
  EXPECT_FALSE(is_kept(30, 0.1f));
  EXPECT_FALSE(is_kept(31));
}

TEST_F(SceneAtTimeTest, TheNearestKeptTimeIsTheOldestOrTheLatest) {
  for (uint64_t tick = 1; tick <= 30; ++tick) apply(at_tick(tick));
  const SnapshotPtr snapshot = scene_.latest();
  EXPECT_EQ(nearest_kept(*snapshot, {3, 0.5f}), (AsOf{20, 0}));
  EXPECT_EQ(nearest_kept(*snapshot, {30, 0.5f}), (AsOf{30, 0}));
  EXPECT_EQ(nearest_kept(*snapshot, {25, 0.5f}), (AsOf{25, 0.5f}));
}

TEST_F(SceneAtTimeTest, ASnapshotKeepsTheHistoryOfItsRevision) {
  apply(at_tick(1, with(points({1}, {1, 0, 0}))));
  apply(at_tick(2, with(move_to({1}, {2, 0, 0}))));
  const SnapshotPtr kept = scene_.latest();
  for (uint64_t tick = 3; tick <= 40; ++tick) apply(at_tick(tick, with(move_to({1}, {float(tick), 0, 0}))));
  const SceneAtTime moment = find_scene_at(*kept, {1, 0.5f}).value();
  EXPECT_EQ(moment.shape(moment.objects().find_ref(1)).position.x, 1.5);
}

}  // namespace
}  // namespace locus::test
