// Tests update batches that move and relabel instances.
#include "core/scene/updates/instance_applier.h"

#include <gmock/gmock.h>

#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <thread>

#include "tests/support/scene_fixture.h"

namespace locus::test {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

class InstanceApplierTest : public SceneFixture {
 protected:
  InstanceApplierTest() { change(placing(placement({5, 6, 7}, {0, 0, 0, 10, 0, 0, 20, 0, 0}))); }

  void change(const StaticChange& what) {
    const absl::StatusOr<InstanceChange> changed = scene_.change_instances(what);
    EXPECT_TRUE(changed.ok()) << changed.status();
  }
  const Instance& instance(Id id) const { return *scene_.latest()->statics->find(id); }

  // Expects that the only item of the move is refused.
  void expect_refused(const InstanceMoveColumns& move, Reason reason, const std::string& field) {
    const uint64_t before = revision();
    const UpdateAck ack = apply(with(move));
    ASSERT_EQ(ack.errors.size(), 1u);
    EXPECT_EQ(ack.errors[0].reason, reason);
    EXPECT_EQ(ack.errors[0].field, field);
    EXPECT_EQ(ack.refused, 1u);
    EXPECT_EQ(ack.applied, 0u);
    EXPECT_EQ(revision(), before);
  }
};

TEST_F(InstanceApplierTest, AMovedInstanceHasItsNewPlaceAndKeepsTheRest) {
  InstanceMoveColumns turn = instances_to({6}, {1, 2, 3});
  turn.rotations = columns_.floats({0, 0, 1, 0});
  turn.scales = columns_.floats({2});
  const UpdateAck ack = apply(with(turn));
  EXPECT_EQ(ack.applied, 1u);
  EXPECT_EQ(ack.revision, 2u);
  EXPECT_EQ(instance(6).transform.translation, (Vec3d{1, 2, 3}));
  EXPECT_EQ(instance(6).transform.quaternion, (Quaternion{0, 0, 1, 0}));
  EXPECT_EQ(instance(6).transform.scale, 2);
  EXPECT_EQ(instance(6).bounds, bounds_to_world(instance(6).transform, mesh_->bounds()));
  EXPECT_TRUE(contains(scene_.latest()->statics->tree().bounds(), instance(6).bounds));
  apply(with(instances_to({6}, {4, 5, 6})));
  EXPECT_EQ(instance(6).transform.translation, (Vec3d{4, 5, 6}));
  EXPECT_EQ(instance(6).transform.quaternion, (Quaternion{0, 0, 1, 0}));
  EXPECT_EQ(instance(6).transform.scale, 2);
  EXPECT_EQ(instance(5).transform.translation, (Vec3d{0, 0, 0}));
}

TEST_F(InstanceApplierTest, FloatPositionsAreRelativeToTheFrame) {
  UpdateBatch batch;
  InstanceMoveColumns& move = batch.instance_moves.emplace_back();
  move.ids = columns_.ids({5, 6});
  move.positions = columns_.floats({1, 2, 3});
  batch.frame = {1e6, 0, 0};
  apply(batch);
  EXPECT_EQ(instance(5).transform.translation, (Vec3d{1e6 + 1, 2, 3}));
  EXPECT_EQ(instance(6).transform.translation, (Vec3d{1e6 + 1, 2, 3}));
}

TEST_F(InstanceApplierTest, ObjectsAndInstancesChangeAtOneRevision) {
  apply(with(points({1, 2}, {0, 0, 0, 1, 1, 1})));
  UpdateBatch batch = with(move_to({1}, {9, 9, 9}));
  batch.instance_moves.push_back(instances_to({7}, {3, 3, 3}));
  const UpdateAck ack = apply(batch);
  EXPECT_EQ(ack.applied, 2u);
  EXPECT_EQ(ack.revision, 3u);
  EXPECT_EQ(object(1)->shape.position, (Vec3d{9, 9, 9}));
  EXPECT_EQ(instance(7).transform.translation, (Vec3d{3, 3, 3}));
  batch.remove_ids = columns_.ids({2});
  batch.instance_moves[0] = instances_to({7}, {4, 4, 4});
  EXPECT_EQ(apply(batch).revision, 4u);
  EXPECT_EQ(instance(7).transform.translation, (Vec3d{4, 4, 4}));
  EXPECT_EQ(ids(), (std::vector<Id>{1}));
}

TEST_F(InstanceApplierTest, RelabelsSetOnlyTheGivenLabels) {
  UpdateBatch hide, group;
  hide.instance_relabels.emplace_back().ids = columns_.ids({5, 6});
  hide.instance_relabels[0].layers = columns_.words({0});
  EXPECT_EQ(apply(hide).applied, 2u);
  EXPECT_EQ(instance(5).layers, 0u);
  EXPECT_EQ(instance(7).layers, kDefaultLayers);
  group.instance_relabels.emplace_back().ids = columns_.ids({5});
  group.instance_relabels[0].groups = columns_.ids({8});
  group.instance_relabels[0].tags = columns_.ids({9});
  apply(group);
  EXPECT_EQ(instance(5).layers, 0u);
  EXPECT_EQ(instance(5).group, 8u);
  EXPECT_EQ(instance(5).tag, 9u);
  StaticChange remove;
  remove.remove_groups = columns_.ids({8});
  change(remove);
  EXPECT_EQ(scene_.latest()->statics->find(5), nullptr);
}

TEST_F(InstanceApplierTest, WrongItemsAreRefusedAlone) {
  expect_refused(instances_to({99}, {0, 0, 0}), Reason::kUnknownId, "instance_moves[0].ids");
  expect_refused(instances_to({5}, {NAN, 0, 0}), Reason::kNotFinite, "instance_moves[0].positions_f64");
  expect_refused(instances_to({5}, {0, 2e9, 0}), Reason::kOutOfRange, "instance_moves[0].positions_f64");
  InstanceMoveColumns move = instances_to({5}, {1, 1, 1});
  move.rotations = columns_.floats({0, 0, 0, 2});
  expect_refused(move, Reason::kOutOfRange, "instance_moves[0].rotations");
  move.rotations = columns_.floats({kNaN, 0, 0, 1});
  expect_refused(move, Reason::kNotFinite, "instance_moves[0].rotations");
  move.rotations = {};
  for (const float scale : {0.0f, -1.0f, 1e13f}) {
    move.scales = columns_.floats({scale});
    expect_refused(move, Reason::kOutOfRange, "instance_moves[0].scales");
  }
  move.scales = columns_.floats({kNaN});
  expect_refused(move, Reason::kNotFinite, "instance_moves[0].scales");
  move.scales = columns_.floats({1e11f});  // the mesh would not lie within the limits
  expect_refused(move, Reason::kOutOfRange, "instance_moves[0].scales");
  EXPECT_EQ(instance(5).transform.translation, (Vec3d{0, 0, 0}));
  UpdateBatch batch = with(instances_to({99, 6}, {1, 1, 1}));
  batch.instance_relabels.emplace_back().ids = columns_.ids({98});
  const UpdateAck ack = apply(batch);
  EXPECT_EQ(ack.applied, 1u);
  EXPECT_EQ(ack.refused, 2u);
  EXPECT_EQ(ack.errors[1].field, "instance_relabels[0].ids");
  EXPECT_EQ(instance(6).transform.translation, (Vec3d{1, 1, 1}));
}

TEST_F(InstanceApplierTest, TheIdOfAnObjectIsNoInstance) {
  apply(with(points({1}, {0, 0, 0})));
  expect_refused(instances_to({1}, {0, 0, 0}), Reason::kUnknownId, "instance_moves[0].ids");
}

TEST_F(InstanceApplierTest, OneWrongItemRefusesABatchThatIsAllOrNothing) {
  UpdateBatch batch = with(instances_to({6, 99}, {1, 1, 1}));
  batch.all_or_nothing = true;
  EXPECT_EQ(scene_.apply(batch).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(instance(6).transform.translation, (Vec3d{10, 0, 0}));
}

TEST_F(InstanceApplierTest, ColumnsOfOtherLengthsRefuseTheBatch) {
  const auto refused = [this](const InstanceMoveColumns& move) {
    return scene_.apply(with(move)).status().code() == absl::StatusCode::kInvalidArgument;
  };
  EXPECT_TRUE(refused(instances_to({5, 6}, {1, 2, 3, 4})));
  InstanceMoveColumns move = instances_to({5, 6, 7}, {1, 2, 3});
  move.scales = columns_.floats({1, 2});
  EXPECT_TRUE(refused(move));
  move.scales = {};
  move.rotations = columns_.floats({0, 0, 0});
  EXPECT_TRUE(refused(move));
}

TEST_F(InstanceApplierTest, ABatchThatChangesNothingMakesNoRevision) {
  EXPECT_EQ(apply(with(instances_to({6}, {10, 0, 0}))).revision, 1u);
  EXPECT_EQ(revision(), 1u);
}

// Only queries of the past see that an instance jumped to the place where it was.
TEST_F(InstanceApplierTest, AJumpToTheSamePlaceMakesARevisionOnlyInASceneWithHistory) {
  InstanceMoveColumns jump = instances_to({6}, {10, 0, 0});
  jump.teleport = true;
  EXPECT_EQ(apply(with(jump)).applied, 1u);
  EXPECT_EQ(revision(), 1u);
  SceneSpec spec;
  spec.history = {10, 1 << 20};
  Scene remembering("remembering", spec, kEpoch, scene_.latest()->statics);
  EXPECT_EQ(remembering.apply(with(jump))->revision, 1u);
}

TEST_F(InstanceApplierTest, ARepeatedBatchMovesNothing) {
  const UpdateBatch first = numbered(with(instances_to({6}, {1, 1, 1})), 3, 1);
  apply(first);
  apply(numbered(with(instances_to({6}, {2, 2, 2})), 3, 2));
  EXPECT_TRUE(apply(numbered(with(instances_to({6}, {3, 3, 3})), 3, 2)).duplicate);
  EXPECT_EQ(instance(6).transform.translation, (Vec3d{2, 2, 2}));
}

TEST_F(InstanceApplierTest, OlderSnapshotsKeepTheirInstances) {
  const SnapshotPtr before = scene_.latest();
  apply(with(instances_to({6}, {1, 1, 1})));
  EXPECT_EQ(before->statics->find(6)->transform.translation, (Vec3d{10, 0, 0}));
}

TEST_F(InstanceApplierTest, AChangeKeepsUpdatesThatWereAppliedMeanwhile) {
  const std::shared_ptr<const StaticSet> base = scene_.latest()->statics;
  StaticChange what = placing(placement({8}, {30, 0, 0}));
  what.remove_ids = columns_.ids({5});
  const auto changed = base->apply(
      what, [](Id) { return false; }, ids_from(kFirstChosenId));
  ASSERT_TRUE(changed.ok()) << changed.status();
  UpdateBatch batch = with(instances_to({5, 6}, {7, 7, 7}));
  batch.instance_relabels.emplace_back().ids = columns_.ids({7});
  batch.instance_relabels[0].groups = columns_.ids({4});
  apply(batch);
  const std::shared_ptr<const StaticSet> updated = scene_.latest()->statics;
  EXPECT_TRUE(updated->regrouped_since(*base, {4}));
  EXPECT_TRUE(updated->regrouped_since(*base, {9, 4}));
  EXPECT_FALSE(updated->regrouped_since(*base, {9}));
  EXPECT_FALSE(updated->regrouped_since(*base, {}));
  const auto both = changed->set->with_updates(*base, *updated);
  EXPECT_EQ(both->size(), 3u);
  EXPECT_EQ(both->find(5), nullptr);
  EXPECT_EQ(both->find(6)->transform.translation, (Vec3d{7, 7, 7}));
  EXPECT_EQ(both->find(7)->group, 4u);
  EXPECT_EQ(both->find(8)->transform.translation, (Vec3d{30, 0, 0}));
}

// Fixture with many more instances, the crowd, whose replacement by a static change takes so long that update batches
// are applied meanwhile. The scene chooses the ids of the crowd. It chooses them again when it builds a change again,
// so that a gap in the ids tells that it has.
class DuringAChangeTest : public InstanceApplierTest {
 protected:
  static constexpr size_t kCrowd = 3'000;
  static constexpr int kMaxRounds = 500;
  static constexpr int kOverlaps = 20;  // number of rounds with an overlap after which a test ends

  DuringAChangeTest() {
    for (size_t i = 0; i < 3 * kCrowd; ++i) places_.push_back(50 + static_cast<double>(i * i % 101));
    replace_crowd({});
  }

  InstanceChange replace_crowd(std::vector<Group> remove_groups) {
    StaticChange what;
    what.place.emplace_back().mesh = mesh_;
    what.place[0].translations = places_;
    what.remove_ids = crowd_;
    what.remove_groups = remove_groups;
    absl::StatusOr<InstanceChange> changed = scene_.change_instances(what);
    EXPECT_TRUE(changed.ok()) << changed.status();
    if (!changed.ok()) return {};
    is_rebuilt_ = !crowd_.empty() && changed->placed.front() != crowd_.back() + 1;
    crowd_ = changed->placed;
    return *std::move(changed);
  }
  // Returns true if the last call of replace_crowd() built its change several times.
  bool is_rebuilt() const { return is_rebuilt_; }

  // Calls update(n) in another thread, for n = 1, 2, 3 and so on, while this object lives.
  class Meanwhile {
   public:
    explicit Meanwhile(std::function<void(int)> update)
        : thread_([this, update = std::move(update)] {
            while (!ended_) {
              update(calls_ + 1);
              ++calls_;
            }
          }) {}
    ~Meanwhile() {
      ended_ = true;
      thread_.join();
    }
    // Returns the number of calls that have returned.
    int calls() const { return calls_; }

   private:
    std::atomic<bool> ended_ = false;
    std::atomic<int> calls_ = 0;
    std::thread thread_;
  };

  // Gives one of the instances 5, 6 and 7 the group `group`, and the others group 0.
  void regroup(int which, Group group) {
    const Id ids[] = {5, 6, 7};
    Group groups[] = {0, 0, 0};
    groups[which] = group;
    UpdateBatch batch;
    batch.instance_relabels.emplace_back().ids = ids;
    batch.instance_relabels[0].groups = groups;
    apply(batch);
  }

 private:
  std::vector<double> places_;
  std::vector<Id> crowd_;
  bool is_rebuilt_ = false;
};

// A static change is built while update batches move another instance. Neither may undo the other.
TEST_F(DuringAChangeTest, MovesAreNotLost) {
  int overlaps = 0, moves = 0;
  {
    const Meanwhile other([this](int n) {
      const Id door = 6;
      const double to[] = {static_cast<double>(n), 0, 0};
      UpdateBatch batch;
      batch.instance_moves.emplace_back().ids = {&door, 1};
      batch.instance_moves[0].positions_f64 = to;
      apply(batch);
      const SnapshotPtr snapshot = scene_.latest();
      EXPECT_EQ(snapshot->statics->find(door)->transform.translation.x, n);
    });
    for (int round = 0; round < kMaxRounds && overlaps < kOverlaps; ++round) {
      const int before = other.calls();
      replace_crowd({77});
      moves = other.calls();
      overlaps += moves - before >= 3 ? 1 : 0;  // at least one move began and ended during the change
    }
  }
  EXPECT_EQ(overlaps, kOverlaps);
  EXPECT_GE(instance(6).transform.translation.x, moves);
  EXPECT_EQ(scene_.latest()->statics->size(), kCrowd + 3);
}

// Exactly the instances that have a removed group just before the change is published are removed.
TEST_F(DuringAChangeTest, AChangeRemovesTheInstancesThatHaveTheGroupWhenItIsPublished) {
  int checked = 0;
  const Meanwhile other([this](int n) { regroup(n % 2, 77); });
  for (int round = 0; round < kMaxRounds && checked < kOverlaps; ++round) {
    const InstanceChange changed = replace_crowd({77});
    const auto before = scene_.view({View::Kind::kExactly, changed.revision - 1, 0}, {});
    const auto after = scene_.view({View::Kind::kExactly, changed.revision, 0}, {});
    std::vector<Id> missing;
    for (const Id id : {5, 6, 7}) {
      if (scene_.latest()->statics->find(id) == nullptr) missing.push_back(id);
      if (!before.ok() || !after.ok()) continue;  // too many revisions were made since
      const Instance* const was = (*before)->statics->find(id);
      ASSERT_NE(was, nullptr);
      EXPECT_EQ((*after)->statics->find(id) != nullptr, was->group != 77) << id;
    }
    if (is_rebuilt() && before.ok() && after.ok()) ++checked;
    if (!missing.empty()) change(placing(placement(missing, {0, 0, 0})));
  }
  EXPECT_EQ(checked, kOverlaps);
}

TEST_F(DuringAChangeTest, RegroupingAmongOtherGroupsDoesNotBuildTheChangeAgain) {
  int overlaps = 0;
  const Meanwhile other([this](int n) { regroup(n % 3, 76); });
  for (int round = 0; round < kMaxRounds && overlaps < kOverlaps; ++round) {
    const int before = other.calls();
    replace_crowd({77});
    ASSERT_FALSE(is_rebuilt());
    overlaps += other.calls() - before >= 3 ? 1 : 0;
  }
  EXPECT_EQ(overlaps, kOverlaps);
}

}  // namespace
}  // namespace locus::test
