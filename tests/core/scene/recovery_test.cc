#include "core/scene/recovery.h"

#include <gmock/gmock.h>

#include "core/scene/log/tree_codec.h"
#include "tests/support/recovery_lockstep.h"
#include "tests/support/scene_fixture.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

TEST(RecoveryTest, ARecoveredSceneEqualsTheSceneThatAppliedTheLoggedRecords) {
  uint64_t crashes = 0, lost = 0, turned_up = 0, followed = 0, promotions = 0;
  for (uint64_t seed = 0; seed < scaled_count(60); ++seed) {
    RecoveryLockstep lockstep(seed);
    ASSERT_EQ(lockstep.run(300), "") << "seed " << seed;
    crashes += lockstep.crashes();
    lost += lockstep.lost();
    turned_up += lockstep.turned_up();
    followed += lockstep.followed();
    promotions += lockstep.promotions();
  }
  EXPECT_LT(scaled_count(6'000), followed) << "records that a follower applied";
  EXPECT_LT(scaled_count(60), promotions) << "followers that became leaders";
  EXPECT_LT(scaled_count(60), crashes);
  EXPECT_NE(lost, 0u);
  EXPECT_NE(turned_up, 0u);
}

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class RecoverTest : public SceneFixture {
 protected:
  RecoverTest() {
    EXPECT_TRUE(registry_.add_mesh("m", mesh_).ok());
    logged_ = registry_.create_scene("arena", {}, kEpoch, "", false)->scene;
  }

  MemoryLog::KeptScene& stored(MemoryLog::Kept& kept) { return kept.scenes.begin()->second; }

  absl::StatusOr<ScenePtr> recover(const MemoryLog::Kept& kept, const RecoveryProgress& progress = nullptr) {
    again_ = std::make_unique<MemoryLog>(kept);
    return recover_scene(*again_, again_->stored_scenes().front(), find_, progress);
  }
  // Recovers the scene from `kept`, expects DATA_LOSS, and returns the error message.
  std::string message(const MemoryLog::Kept& kept) {
    const absl::Status status = recover(kept).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
    return std::string(status.message());
  }

  void apply(const UpdateBatch& batch) { ASSERT_TRUE(logged_->apply(batch).ok()); }

  MemoryLog log_;
  Registry registry_{&log_};
  ScenePtr logged_;
  std::unique_ptr<MemoryLog> again_;
  FindMesh find_ = [this](const MeshKey& key) { return key == mesh_->key() ? mesh_ : nullptr; };
};

TEST_F(RecoverTest, AMissingLastRecordIsDetected) {
  for (Id id = 1; id <= 3; ++id) apply(with(points({id}, {0, 0, 0})));
  MemoryLog::Kept kept = log_.crash();
  MemoryLog fewer(kept);
  StoredScene expected = fewer.stored_scenes().front();
  expected.last_sequence = 5;
  EXPECT_EQ(recover_scene(fewer, expected, find_).status(),
            absl::DataLossError("scene arena: records 4 to 5 are not there"));
}

// Log that breaks the contract of UpdateLog: read() omits record 2.
class GappedLog : public MemoryLog {
 public:
  using MemoryLog::MemoryLog;
  absl::Status read(SceneKey key, uint64_t from, RecordSink sink) const override {
    return MemoryLog::read(
        key, from, [&](const LogRecord& record) { return record.sequence == 2 ? absl::OkStatus() : sink(record); });
  }
};

TEST_F(RecoverTest, AGapInTheRecordsIsDetected) {
  for (Id id = 1; id <= 3; ++id) apply(with(points({id}, {0, 0, 0})));
  GappedLog holey(log_.crash());
  EXPECT_EQ(recover_scene(holey, holey.stored_scenes().front(), find_).status(),
            absl::DataLossError("scene arena: record 3 follows record 1"));
}

TEST_F(RecoverTest, ErrorsNameTheDamagedRecordSnapshotOrSpecification) {
  apply(with(points({1}, {0, 0, 0})));
  const MemoryLog::Kept kept = log_.crash();
  MemoryLog::Kept wrong = kept;
  stored(wrong).records[0].bytes = std::make_shared<std::string>("short");
  EXPECT_EQ(message(wrong), "scene arena: record 1: the kind is cut off");
  wrong = kept;
  stored(wrong).snapshot.clear();
  EXPECT_EQ(message(wrong), "scene arena: snapshot: the header is missing");
  wrong = kept;
  stored(wrong).spec = "";
  EXPECT_EQ(message(wrong), "scene arena: specification: the kind is cut off");
}

TEST_F(RecoverTest, ScenesAndMeshesMarkedAsDamagedAreNotRead) {
  MemoryLog again(log_.crash());
  StoredScene damaged = again.stored_scenes().front();
  damaged.damage = absl::DataLossError("a file is gone");
  EXPECT_EQ(recover_scene(again, damaged, find_).status(), absl::DataLossError("scene arena: a file is gone"));
  StoredMesh mesh = again.stored_meshes().front();
  mesh.damage = absl::DataLossError("a file is gone");
  EXPECT_EQ(recover_mesh(again, mesh).status(), absl::DataLossError("mesh m: a file is gone"));
}

// If the stored topology is from another builder version, damaged or missing, the tree is built and its topology is
// stored again.
TEST_F(RecoverTest, AnUnusableTopologyIsReplacedByThatOfARebuiltTree) {
  const MemoryLog::Kept kept = log_.crash();
  ASSERT_EQ(kept.topologies.size(), 1u);
  const std::string right = kept.topologies.at(mesh_->sha256());
  std::string of_another_builder = right, of_other_triangles = right;
  of_another_builder[8] = static_cast<char>(kBvhBuilderVersion + 1);
  of_other_triangles[24] = static_cast<char>(99);  // number of the first triangle
  for (const std::string& wrong : {of_another_builder, of_other_triangles, right.substr(0, 20), std::string()}) {
    MemoryLog again(kept);
    again.store_topology(mesh_->sha256(), wrong);
    for (const bool built : {true, false}) {
      const absl::StatusOr<RecoveredMesh> mesh = recover_mesh(again, again.stored_meshes().front());
      ASSERT_TRUE(mesh.ok()) << mesh.status();
      EXPECT_EQ(mesh->built, built);
      EXPECT_EQ(mesh->mesh->vertices(), mesh_->vertices());
    }
    EXPECT_EQ(again.read_topology(mesh_->sha256()), right);
  }
  MemoryLog::Kept without = kept;
  without.topologies.clear();
  MemoryLog again(without);
  EXPECT_TRUE(recover_mesh(again, again.stored_meshes().front())->built);
  EXPECT_EQ(again.read_topology(mesh_->sha256()), right);
}

TEST_F(RecoverTest, ASceneWithLostRecordsContinuesInAnotherEpoch) {
  const UpdateBatch insert = numbered(with(points({1}, {0, 0, 0})), 9, 1);
  apply(insert);
  ASSERT_TRUE(log_.restart_scene(logged_->log_key(), 99).ok());
  const absl::StatusOr<ScenePtr> scene = recover(log_.crash());
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_EQ((*scene)->latest()->epoch, 99u);
  EXPECT_EQ((*scene)->latest()->revision, 1u);
  EXPECT_EQ((*scene)->apply(insert)->epoch, kEpoch);
  EXPECT_EQ((*scene)->apply(with(move_to({1}, {1, 0, 0})))->epoch, 99u);
  const absl::StatusOr<ScenePtr> third = recover(again_->crash());
  ASSERT_TRUE(third.ok()) << third.status();
  EXPECT_EQ((*third)->latest()->epoch, 99u);
  EXPECT_EQ((*third)->latest()->revision, 2u);
}

TEST_F(RecoverTest, AnEarlierEpochIsRefusedAsDamage) {
  for (Id id = 1; id <= 3; ++id) apply(with(points({id}, {0, 0, 0})));
  MemoryLog::Kept kept = log_.crash();
  stored(kept).records[1].epoch = 99;
  EXPECT_EQ(message(kept), "scene arena: record 3: epoch 77 follows epoch 99");
  stored(kept).records[2].epoch = 0;
  EXPECT_EQ(message(kept), "scene arena: record 3: epoch 0 follows epoch 99");
}

TEST_F(RecoverTest, AMissingMeshWithoutInstancesIsAccepted) {
  ASSERT_TRUE(logged_->change_instances(placing(placement({5}, {1, 2, 3}))).ok());
  MemoryLog::Kept used = log_.crash();
  StaticChange removal;
  removal.remove_ids = columns_.ids({5});
  ASSERT_TRUE(logged_->change_instances(removal).ok());
  find_ = [](const MeshKey&) { return nullptr; };
  EXPECT_THAT(message(used), HasSubstr("scene arena: the mesh of content 0100"));
  const absl::StatusOr<ScenePtr> scene = recover(log_.crash());
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_EQ((*scene)->latest()->statics->size(), 0u);
}

TEST_F(RecoverTest, AnInvalidStaticChangeIsDamage) {
  ASSERT_TRUE(logged_->change_instances(placing(placement({5}, {1, 2, 3}))).ok());
  MemoryLog::Kept kept = log_.crash();
  stored(kept).records.push_back(stored(kept).records[0]);
  EXPECT_THAT(message(kept), HasSubstr("scene arena: record 2: the change is wrong"));
}

TEST_F(RecoverTest, TheHistoryBeginsAtTheSnapshot) {
  SceneSpec spec;
  spec.history = {50, uint64_t{1} << 30};
  const ScenePtr remembering = registry_.create_scene("remembering", spec, kEpoch, "", false)->scene;
  const auto go_to = [&](uint64_t tick) {
    UpdateBatch batch = with(points({1}, {static_cast<float>(tick), 0, 0}));
    batch.upsert = true;
    batch.tick = tick;
    ASSERT_TRUE(remembering->apply(batch).ok());
  };
  for (uint64_t tick = 1; tick <= 5; ++tick) go_to(tick);
  const FrozenScene frozen = remembering->freeze();
  StateWriter state(frozen);
  ASSERT_TRUE(log_.write_snapshot(remembering->log_key(), 5, [&state] { return state.next(); }).ok());
  for (uint64_t tick = 6; tick <= 8; ++tick) go_to(tick);
  MemoryLog again(log_.crash());
  const auto scene = recover_scene(again, again.stored_scenes()[1], find_);
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_EQ((*scene)->latest()->oldest_tick(), 5u);
  EXPECT_EQ((*scene)->latest()->past_limit, PastLimit::kRestored);
  EXPECT_EQ(find_scene_at(*(*scene)->latest(), {7, 0})->objects().find(1)->shape.position.x, 7);
}

// Deletes the mesh of instances of the ticks 1 to 3. The live scene and the recovered one keep the later ticks only, so
// that a query of an earlier tick is refused and does not miss the mesh.
TEST_F(RecoverTest, TicksOfADeletedMeshAreForgottenAsTheLiveSceneForgotThem) {
  SceneSpec spec;
  spec.history = {50, uint64_t{1} << 30};
  const ScenePtr live = registry_.create_scene("remembering", spec, kEpoch, "", false)->scene;
  const auto go_to = [&](uint64_t tick) {
    UpdateBatch batch = with(points({1}, {static_cast<float>(tick), 0, 0}));
    batch.upsert = true;
    batch.tick = tick;
    ASSERT_TRUE(live->apply(batch).ok());
  };
  ASSERT_TRUE(live->change_instances(placing(placement({5}, {1, 2, 3}))).ok());
  for (uint64_t tick = 1; tick <= 4; ++tick) go_to(tick);
  StaticChange removal;
  removal.remove_ids = columns_.ids({5});
  ASSERT_TRUE(live->change_instances(removal).ok());
  for (uint64_t tick = 5; tick <= 7; ++tick) go_to(tick);
  live->forget_mesh(mesh_.get());
  ASSERT_EQ(live->latest()->oldest_tick(), 4u);
  find_ = [](const MeshKey&) { return nullptr; };
  MemoryLog again(log_.crash());
  const auto scene = recover_scene(again, again.stored_scenes()[1], find_);
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_EQ((*scene)->latest()->oldest_tick(), 4u);
  EXPECT_EQ((*scene)->latest()->past_limit, live->latest()->past_limit);
  EXPECT_EQ((*scene)->latest()->forgotten_ticks, live->latest()->forgotten_ticks);
  EXPECT_EQ(find_scene_at(*(*scene)->latest(), {3, 0}), std::nullopt);
  EXPECT_EQ(find_scene_at(*(*scene)->latest(), {4, 0})->statics().size(), 0u);
}

// Refused batches are in the log as well. Whether a move of an instance is refused depends on the bounds of its mesh,
// which a replay must know although the mesh is deleted. The mesh is used first by a record, then by the snapshot.
TEST_F(RecoverTest, AReplayRefusesTheSameMovesOfInstancesOfADeletedMesh) {
  for (const bool in_snapshot : {false, true}) {
    SCOPED_TRACE(in_snapshot);
    const Id door = in_snapshot ? 6 : 5, object = in_snapshot ? 2 : 1;
    ASSERT_TRUE(logged_->change_instances(placing(placement({door}, {1, 2, 3}))).ok());
    if (in_snapshot) {
      const FrozenScene frozen = logged_->freeze();
      StateWriter state(frozen);
      ASSERT_TRUE(log_.write_snapshot(logged_->log_key(), frozen.sequence, [&state] { return state.next(); }).ok());
    }
    UpdateBatch batch = with(points({object}, {0, 0, 0}));
    batch.all_or_nothing = true;
    batch.instance_moves.push_back(instances_to({door}, {0, 0, 0}));
    batch.instance_moves[0].scales = columns_.floats({1e11f});  // the mesh would not lie within the limits
    ASSERT_EQ(logged_->apply(batch).status().code(), absl::StatusCode::kInvalidArgument);
    StaticChange removal;
    removal.remove_ids = columns_.ids({door});
    ASSERT_TRUE(logged_->change_instances(removal).ok());
    find_ = [](const MeshKey&) { return nullptr; };
    const absl::StatusOr<ScenePtr> scene = recover(log_.crash());
    ASSERT_TRUE(scene.ok()) << scene.status();
    EXPECT_EQ((*scene)->latest()->objects.find(object), std::nullopt);
    EXPECT_EQ((*scene)->latest()->revision, logged_->latest()->revision);
  }
}

TEST_F(RecoverTest, ProgressIsReported) {
  for (Id id = 1; id <= 100; ++id) apply(with(points({id}, {0, 0, 0})));
  std::vector<std::pair<uint64_t, uint64_t>> reports;
  ASSERT_TRUE(recover(log_.crash(), [&](uint64_t applied, uint64_t of) { reports.emplace_back(applied, of); }).ok());
  EXPECT_THAT(reports, ElementsAre(std::pair(64u, 100u), std::pair(100u, 100u)));
}

}  // namespace
}  // namespace locus::test
