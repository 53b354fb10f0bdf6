// Tests of everything that the interface UpdateLog promises. Each test runs twice: on PostgreSQL, and on a data
// directory of RocksDB.
#include "server/storage/postgres_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "core/base/refusal.h"
#include "server/storage/rocksdb_log.h"
#include "tests/support/log_fixture.h"
#include "tests/support/postgres_server.h"
#include "tests/support/test_scale.h"

namespace locus::server {
namespace {

using test::append_records;
using test::create_scene;
using test::find_stored;
using test::hash_of;
using test::read_mesh;
using test::write_snapshot;
using ::testing::HasSubstr;

enum class Store : uint8_t { kRocksdb, kPostgres };

class UpdateLogTest : public test::LogFixture, public ::testing::WithParamInterface<Store> {
 protected:
  void SetUp() override {
    if (GetParam() == Store::kPostgres) {
      if (!test::PostgresServer::installed()) GTEST_SKIP() << test::PostgresServer::kMissing;
      engine_ = std::make_unique<test::PostgresServer>();
    }
    open();
  }

  void open() {
    log_ = nullptr;
    if (GetParam() == Store::kPostgres) {
      log_ = test::open_and_lead(engine_->options());
    } else {
      StorageOptions options;
      options.path = folder_.file("data");
      options.reserve_bytes = 0;
      auto log = RocksdbLog::open(options);
      ASSERT_TRUE(log.ok()) << log.status();
      log_ = *std::move(log);
    }
    ASSERT_NE(log_, nullptr);
  }

  test::TemporaryFolder folder_;
  std::unique_ptr<test::PostgresServer> engine_;
};

INSTANTIATE_TEST_SUITE_P(Stores, UpdateLogTest, ::testing::Values(Store::kRocksdb, Store::kPostgres),
                         [](const auto& store) { return store.param == Store::kRocksdb ? "Rocksdb" : "Postgres"; });

TEST_P(UpdateLogTest, NewDirectoryHoldsNothing) {
  EXPECT_TRUE(log_->stored_scenes().empty());
  EXPECT_TRUE(log_->stored_meshes().empty());
}

TEST_P(UpdateLogTest, RecordsAreReadBackAsTheyWereAppended) {
  const SceneKey scene = create("a", 1);
  append(scene, 20);
  expect_records(scene, 1, 20);
  expect_records(scene, 13, 20);
  expect_snapshot(scene, 0);
}

TEST_P(UpdateLogTest, SeveralEntriesGetConsecutiveSequenceNumbers) {
  const SceneKey scene = create("a", 1);
  std::vector<std::string> bytes;
  for (uint64_t i = 1; i <= 5; ++i) bytes.push_back(test::record_bytes(scene, i));
  std::vector<LogEntry> entries;
  for (uint64_t i = 1; i <= 5; ++i) entries.push_back(test::entry_of(7, i, bytes[i - 1]));
  EXPECT_EQ(log_->append(scene, entries, AckLevel::kLocal).value(), 5u);
  EXPECT_EQ(log_->append(scene, {}, AckLevel::kLocal).value(), 5u);
  expect_records(scene, 1, 5);
}

TEST_P(UpdateLogTest, ReopenedLogHasEverySceneRecordAndMesh) {
  const SceneKey a = create("a", 1);
  const SceneKey b = create("b", 2);
  append(a, 10);
  append(b, 3);
  ASSERT_EQ(append_records(*log_, b, 7, 4, AckLevel::kMemory), absl::OkStatus());
  ASSERT_EQ(write_snapshot(*log_, a, 6), absl::OkStatus());
  ASSERT_EQ(add_mesh("m", 3, {"content"}), absl::OkStatus());
  for (int times = 0; times < 2; ++times) {
    open();
    EXPECT_TRUE(log_->closed_in_order());
    ASSERT_EQ(log_->stored_scenes().size(), 2u);
    const StoredScene& stored = log_->stored_scenes()[0];
    EXPECT_EQ(stored.key, a);
    EXPECT_EQ(stored.name, "a");
    EXPECT_EQ(stored.spec, "spec of a");
    EXPECT_EQ(stored.epoch, 7u);
    EXPECT_EQ(stored.snapshot_sequence, 6u);
    EXPECT_EQ(stored.last_sequence, 10u);
    EXPECT_EQ(stored.damage, absl::OkStatus());
    expect_snapshot(a, 6);
    expect_records(a, 7, 10);
    expect_snapshot(b, 0);
    expect_records(b, 1, 7);
    ASSERT_EQ(log_->stored_meshes().size(), 1u);
    EXPECT_EQ(log_->stored_meshes()[0].name, "m");
    EXPECT_EQ(log_->stored_meshes()[0].sha256, hash_of(3));
  }
}

TEST_P(UpdateLogTest, SnapshotDropsTheRecordsItHolds) {
  const SceneKey scene = create("a", 1);
  append(scene, 10);
  ASSERT_EQ(write_snapshot(*log_, scene, 10), absl::OkStatus());
  expect_snapshot(scene, 10);
  expect_records(scene, 11, 10);
  const absl::Status before = log_->read(scene, 10, [](const LogRecord&) { return absl::OkStatus(); });
  EXPECT_EQ(before.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(before.message(), HasSubstr("in the snapshot"));
  append(scene, 5);
  open();
  expect_records(scene, 11, 15);
  EXPECT_EQ(find_stored(*log_, "a")->snapshot_sequence, 10u);
}

TEST_P(UpdateLogTest, SnapshotOfMissingRecordsIsRefused) {
  const SceneKey scene = create("a", 1);
  append(scene, 3);
  EXPECT_EQ(write_snapshot(*log_, scene, 4).code(), absl::StatusCode::kInvalidArgument);
  ASSERT_EQ(write_snapshot(*log_, scene, 2), absl::OkStatus());
  EXPECT_EQ(write_snapshot(*log_, scene, 1).code(), absl::StatusCode::kInvalidArgument);
  expect_snapshot(scene, 2);
  expect_records(scene, 3, 3);
}

TEST_P(UpdateLogTest, FailedSnapshotKeepsThePreviousOne) {
  const SceneKey scene = create("a", 1);
  append(scene, 3);
  int left = 2;
  const auto failing = [&]() -> absl::StatusOr<std::optional<std::string>> {
    if (left-- > 0) return std::string(size_t{1} << 20, 'x');
    return absl::CancelledError("no more");
  };
  EXPECT_EQ(log_->write_snapshot(scene, 3, failing), absl::CancelledError("no more"));
  const auto long_chunk = [&]() -> absl::StatusOr<std::optional<std::string>> {
    return std::string(UpdateLog::kMaxChunkBytes + 1, 'x');
  };
  EXPECT_EQ(log_->write_snapshot(scene, 3, long_chunk).code(), absl::StatusCode::kInvalidArgument);
  expect_snapshot(scene, 0);
  expect_records(scene, 1, 3);
  open();
  expect_snapshot(scene, 0);
  expect_records(scene, 1, 3);
  ASSERT_EQ(write_snapshot(*log_, scene, 3), absl::OkStatus());
  expect_snapshot(scene, 3);
}

TEST_P(UpdateLogTest, KeyOfADeletedSceneIsNeverReused) {
  const SceneKey a = create("a", 1);
  append(a, 3);
  ASSERT_EQ(log_->delete_scene(a), absl::OkStatus());
  EXPECT_EQ(append_records(*log_, a, 7, 1).code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(log_->delete_scene(a).code(), absl::StatusCode::kNotFound);
  open();
  EXPECT_TRUE(log_->stored_scenes().empty());
  EXPECT_EQ(create("a", 2), 2u);
  expect_records(2, 1, 0);
}

TEST_P(UpdateLogTest, TakenNameIsRefused) {
  create("a", 1);
  EXPECT_EQ(create_scene(*log_, "a", 2).status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(log_->stored_scenes().size(), 0u) << "stored_scenes() shows the state at opening";
  open();
  EXPECT_EQ(log_->stored_scenes().size(), 1u);
}

TEST_P(UpdateLogTest, RestartedSceneAcceptsOnlyRecordsOfTheNewEpoch) {
  const SceneKey scene = create("a", 1);
  append(scene, 2);
  ASSERT_EQ(log_->restart_scene(scene, 8), absl::OkStatus());
  const absl::Status stale = append_records(*log_, scene, 7, 1);
  EXPECT_EQ(stale.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(refusal_of(stale)->reason, Reason::kSceneRestarted);
  ASSERT_EQ(append_records(*log_, scene, 8, 1), absl::OkStatus());
  open();
  EXPECT_EQ(find_stored(*log_, "a")->epoch, 8u);
  expect_records(scene, 1, 3);
}

TEST_P(UpdateLogTest, AnotherSpecificationOfASceneIsStored) {
  const SceneKey scene = create("a", 1);
  append(scene, 2);
  ASSERT_EQ(log_->set_scene_spec(scene, "another"), absl::OkStatus());
  append(scene, 1);
  EXPECT_EQ(log_->set_scene_spec(scene + 1, "none").code(), absl::StatusCode::kNotFound);
  open();
  EXPECT_EQ(find_stored(*log_, "a")->spec, "another");
  expect_records(scene, 1, 3);
}

TEST_P(UpdateLogTest, MeshIsStoredOnceAndDeletedWithItsLastName) {
  const std::vector<std::string> content = {"some", "content"};
  ASSERT_EQ(add_mesh("a", 1, content), absl::OkStatus());
  EXPECT_EQ(asked_, 2u);
  ASSERT_EQ(add_mesh("b", 1, content), absl::OkStatus());
  EXPECT_EQ(asked_, 0u);
  ASSERT_EQ(add_mesh("a", 1, content), absl::OkStatus()) << "the same again";
  EXPECT_EQ(add_mesh("a", 2, content).code(), absl::StatusCode::kAlreadyExists);
  ASSERT_EQ(log_->delete_mesh("a"), absl::OkStatus());
  EXPECT_EQ(log_->delete_mesh("a").code(), absl::StatusCode::kNotFound);
  open();
  ASSERT_EQ(log_->stored_meshes().size(), 1u);
  EXPECT_EQ(log_->stored_meshes()[0].name, "b");
  EXPECT_EQ(read_mesh(*log_, hash_of(1)).value(), content);
  ASSERT_EQ(log_->delete_mesh("b"), absl::OkStatus());
  EXPECT_EQ(read_mesh(*log_, hash_of(1)).status().code(), absl::StatusCode::kNotFound);
}

TEST_P(UpdateLogTest, PartsAreKeptForEachNameAndGoWithIt) {
  using Chunks = std::vector<std::string>;
  for (const char* const name : {"a", "b", "c"}) ASSERT_EQ(add_mesh(name, 1, {"content"}), absl::OkStatus());
  open();
  ASSERT_EQ(log_->stored_meshes().size(), 3u);
  EXPECT_FALSE(log_->stored_meshes()[1].parts_in_content);
  EXPECT_EQ(test::read_parts(*log_, "a").value(), (Chunks{"parts of", "a"}));
  EXPECT_EQ(test::read_parts(*log_, "b").value(), (Chunks{"parts of", "b"}));
  ASSERT_EQ(log_->delete_mesh("a"), absl::OkStatus());
  open();
  EXPECT_EQ(test::read_parts(*log_, "a").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(test::read_parts(*log_, "b").value(), (Chunks{"parts of", "b"}));
  EXPECT_EQ(read_mesh(*log_, hash_of(1)).value(), Chunks{"content"});
  ASSERT_EQ(log_->delete_mesh("b"), absl::OkStatus());
  ASSERT_EQ(log_->delete_mesh("c"), absl::OkStatus());
  EXPECT_EQ(read_mesh(*log_, hash_of(1)).status().code(), absl::StatusCode::kNotFound);
}

TEST_P(UpdateLogTest, TheGraceOfAMeshIsKeptForItsNameAndGoesWithIt) {
  for (const char* const name : {"a", "b"}) ASSERT_EQ(add_mesh(name, 1, {"content"}), absl::OkStatus());
  ASSERT_EQ(log_->set_mesh_graces({"a"}, 7), absl::OkStatus());
  ASSERT_EQ(log_->set_mesh_graces({"a"}, 60), absl::OkStatus());
  EXPECT_EQ(log_->set_mesh_graces({"b", "c"}, 60).code(), absl::StatusCode::kNotFound);
  for (int times = 0; times < 2; ++times) {
    open();
    ASSERT_EQ(log_->stored_meshes().size(), 2u);
    EXPECT_EQ(log_->stored_meshes()[0].grace_s, 60u);
    EXPECT_EQ(log_->stored_meshes()[1].grace_s, 0u);
    EXPECT_FALSE(log_->stored_meshes()[0].parts_in_content);
    EXPECT_EQ(test::read_parts(*log_, "a").value(), (std::vector<std::string>{"parts of", "a"}));
  }
  ASSERT_EQ(log_->delete_mesh("a"), absl::OkStatus());
  ASSERT_EQ(add_mesh("a", 1, {"content"}), absl::OkStatus());
  open();
  EXPECT_EQ(log_->stored_meshes()[0].grace_s, 0u) << "this is another mesh";
}

TEST_P(UpdateLogTest, AMeshWhosePartsCannotBeReadIsNotStored) {
  const test::ChunksFrom content({"content"});
  const auto parts = [] { return absl::StatusOr<std::optional<std::string>>(absl::CancelledError("enough")); };
  EXPECT_EQ(log_->add_mesh("a", hash_of(1), content, parts), absl::CancelledError("enough"));
  open();
  EXPECT_TRUE(log_->stored_meshes().empty());
  EXPECT_EQ(read_mesh(*log_, hash_of(1)).status().code(), absl::StatusCode::kNotFound);
}

// Runs one thread per scene that appends records, and one thread that writes snapshots of all scenes.
TEST_P(UpdateLogTest, ConcurrentAppendsAndSnapshotsKeepEveryRecord) {
  constexpr int kScenes = 8;
  const uint64_t records = test::scaled_count(200);
  for (int i = 0; i < kScenes; ++i) create("scene" + std::to_string(i), static_cast<SceneKey>(i + 1));
  std::atomic<int> at_work = kScenes;
  std::vector<std::thread> threads;
  for (SceneKey scene = 1; scene <= kScenes; ++scene) {
    threads.emplace_back([&, scene] {
      EXPECT_EQ(append_records(*log_, scene, 7, records), absl::OkStatus());
      --at_work;
    });
  }
  std::vector<uint64_t> snapshots(kScenes + 1);
  while (at_work > 0) {
    for (SceneKey scene = 1; scene <= kScenes; ++scene) {
      snapshots[scene] = log_->latest(scene).value();
      ASSERT_EQ(write_snapshot(*log_, scene, snapshots[scene]), absl::OkStatus());
    }
  }
  for (std::thread& thread : threads) thread.join();
  open();
  for (SceneKey scene = 1; scene <= kScenes; ++scene) {
    expect_snapshot(scene, snapshots[scene]);
    expect_records(scene, snapshots[scene] + 1, records);
  }
}

}  // namespace
}  // namespace locus::server
