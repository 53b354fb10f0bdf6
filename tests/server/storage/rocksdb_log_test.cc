#include "server/storage/rocksdb_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <thread>

#include "core/base/refusal.h"
#include "rocksdb/db.h"
#include "server/storage/rocksdb/rows.h"
#include "tests/support/faulty_files.h"
#include "tests/support/stored_log.h"
#include "tests/support/test_scale.h"

namespace locus::server {
namespace {

using test::append_records;
using test::create_scene;
using test::find_stored;
using test::hash_of;
using test::read_mesh;
using test::read_snapshot;
using test::record_difference;
using test::snapshot_chunks;
using test::write_snapshot;
using ::testing::HasSubstr;

class RocksdbLogTest : public ::testing::Test {
 protected:
  RocksdbLogTest() {
    options_.path = folder_.file("data");
    options_.reserve_bytes = 0;
    open();
  }

  void open() {
    log_ = nullptr;
    auto log = RocksdbLog::open(options_);
    ASSERT_TRUE(log.ok()) << log.status();
    log_ = *std::move(log);
  }
  SceneKey create(const std::string& name, SceneKey expected) {
    const auto key = create_scene(*log_, name, expected);
    EXPECT_TRUE(key.ok()) << key.status();
    EXPECT_EQ(*key, expected);
    return *key;
  }
  void append(SceneKey scene, uint64_t count) { ASSERT_EQ(append_records(*log_, scene, 7, count), absl::OkStatus()); }
  // Expects that the scene's records from `first` to `last` are intact and that there are no later records.
  void expect_records(SceneKey scene, uint64_t first, uint64_t last) {
    uint64_t found = 0;
    EXPECT_EQ(record_difference(*log_, scene, first, found), "");
    EXPECT_EQ(found, last);
    EXPECT_EQ(log_->latest(scene).value(), last);
  }
  void expect_snapshot(SceneKey scene, uint64_t sequence) {
    const auto chunks = read_snapshot(*log_, scene);
    ASSERT_TRUE(chunks.ok()) << chunks.status();
    EXPECT_EQ(*chunks, snapshot_chunks(scene, sequence));
  }
  absl::Status add_mesh(const std::string& name, uint8_t number, const std::vector<std::string>& chunks) {
    const test::ChunksFrom content(chunks), parts({"parts of", name});
    const absl::Status status = log_->add_mesh(name, hash_of(number), content, parts);
    asked_ = content.asked();
    return status;
  }

  test::TemporaryFolder folder_;
  StorageOptions options_;
  std::unique_ptr<RocksdbLog> log_;
  size_t asked_ = 0;
};

TEST_F(RocksdbLogTest, NewDirectoryHoldsNothing) {
  EXPECT_TRUE(log_->stored_scenes().empty());
  EXPECT_TRUE(log_->stored_meshes().empty());
}

TEST_F(RocksdbLogTest, RecordsAreReadBackAsTheyWereAppended) {
  const SceneKey scene = create("a", 1);
  append(scene, 20);
  expect_records(scene, 1, 20);
  expect_records(scene, 13, 20);
  expect_snapshot(scene, 0);
}

TEST_F(RocksdbLogTest, SeveralEntriesGetConsecutiveSequenceNumbers) {
  const SceneKey scene = create("a", 1);
  std::vector<std::string> bytes;
  for (uint64_t i = 1; i <= 5; ++i) bytes.push_back(test::record_bytes(scene, i));
  std::vector<LogEntry> entries;
  for (uint64_t i = 1; i <= 5; ++i) entries.push_back(test::entry_of(7, i, bytes[i - 1]));
  EXPECT_EQ(log_->append(scene, entries, AckLevel::kLocal).value(), 5u);
  EXPECT_EQ(log_->append(scene, {}, AckLevel::kLocal).value(), 5u);
  expect_records(scene, 1, 5);
}

TEST_F(RocksdbLogTest, ReopenedLogHasEverySceneRecordAndMesh) {
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

TEST_F(RocksdbLogTest, SnapshotDropsTheRecordsItHolds) {
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

TEST_F(RocksdbLogTest, SnapshotOfMissingRecordsIsRefused) {
  const SceneKey scene = create("a", 1);
  append(scene, 3);
  EXPECT_EQ(write_snapshot(*log_, scene, 4).code(), absl::StatusCode::kInvalidArgument);
  ASSERT_EQ(write_snapshot(*log_, scene, 2), absl::OkStatus());
  EXPECT_EQ(write_snapshot(*log_, scene, 1).code(), absl::StatusCode::kInvalidArgument);
  expect_snapshot(scene, 2);
  expect_records(scene, 3, 3);
}

TEST_F(RocksdbLogTest, FailedSnapshotKeepsThePreviousOne) {
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

TEST_F(RocksdbLogTest, KeyOfADeletedSceneIsNeverReused) {
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

TEST_F(RocksdbLogTest, TakenNameIsRefused) {
  create("a", 1);
  EXPECT_EQ(create_scene(*log_, "a", 2).status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(log_->stored_scenes().size(), 0u) << "stored_scenes() shows the state at opening";
  open();
  EXPECT_EQ(log_->stored_scenes().size(), 1u);
}

TEST_F(RocksdbLogTest, RestartedSceneAcceptsOnlyRecordsOfTheNewEpoch) {
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

TEST_F(RocksdbLogTest, AnotherSpecificationOfASceneIsStored) {
  const SceneKey scene = create("a", 1);
  append(scene, 2);
  ASSERT_EQ(log_->set_scene_spec(scene, "another"), absl::OkStatus());
  append(scene, 1);
  EXPECT_EQ(log_->set_scene_spec(scene + 1, "none").code(), absl::StatusCode::kNotFound);
  open();
  EXPECT_EQ(find_stored(*log_, "a")->spec, "another");
  expect_records(scene, 1, 3);
}

TEST_F(RocksdbLogTest, MeshIsStoredOnceAndDeletedWithItsLastName) {
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

TEST_F(RocksdbLogTest, PartsAreKeptForEachNameAndGoWithIt) {
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

TEST_F(RocksdbLogTest, TheGraceOfAMeshIsKeptForItsNameAndGoesWithIt) {
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

TEST_F(RocksdbLogTest, DamagedContentIsStoredAgainWhenItIsUploadedAgain) {
  // The content is larger than a block of a table, so that damage to it does not make other values unreadable.
  const std::vector<std::string> content = {"the bytes of a mesh" + std::string(200'000, '.')};
  ASSERT_EQ(add_mesh("a", 1, content), absl::OkStatus());
  ASSERT_EQ(add_mesh("b", 1, content), absl::OkStatus());
  open();  // reopens, so that RocksDB writes the content from its log into a table
  log_ = nullptr;
  test::flip_bit_of(content[0], options_.path + "/rocksdb");
  open();
  ASSERT_EQ(read_mesh(*log_, hash_of(1)).status().code(), absl::StatusCode::kDataLoss);
  ASSERT_EQ(add_mesh("c", 1, content), absl::OkStatus());
  EXPECT_EQ(asked_, 1u) << "the log must not rely on content that it could not read";
  EXPECT_EQ(read_mesh(*log_, hash_of(1)).value(), content);
  ASSERT_EQ(add_mesh("d", 1, content), absl::OkStatus());
  EXPECT_EQ(asked_, 0u) << "now the content is stored";
  open();
  EXPECT_EQ(log_->stored_meshes().size(), 4u);
  EXPECT_EQ(read_mesh(*log_, hash_of(1)).value(), content);
}

// Returns the format number that is stored in a directory. No process may have the directory open.
uint32_t format_of(const std::string& path) {
  rocksdb::DB* raw = nullptr;
  const rocksdb::Status opened = rocksdb::DB::OpenForReadOnly(rocksdb::Options(), path + "/rocksdb", &raw);
  EXPECT_TRUE(opened.ok()) << opened.ToString();
  const std::unique_ptr<rocksdb::DB> database(raw);
  std::string value;
  EXPECT_TRUE(database->Get(rocksdb::ReadOptions(), std::string(kFormatKey), &value).ok());
  const std::optional<absl::string_view> bytes = verified(kFormatKey, value);
  return bytes ? static_cast<uint32_t>(static_cast<unsigned char>(bytes->front())) : 0;
}

TEST_F(RocksdbLogTest, ADirectoryOfFormat1GetsTheLatestFormatAndItsMeshesKeepTheirPartsInTheContent) {
  options_.path = folder_.file("sample");
  std::filesystem::copy(LOCUS_SOURCE_DIR "/tests/golden/data/format-1/data", options_.path,
                        std::filesystem::copy_options::recursive);
  EXPECT_EQ(format_of(options_.path), 1u);
  open();
  ASSERT_EQ(log_->stored_meshes().size(), 1u);
  const StoredMesh stored = log_->stored_meshes()[0];
  EXPECT_TRUE(stored.parts_in_content);
  EXPECT_TRUE(test::read_parts(*log_, stored.name)->empty());
  const test::ChunksFrom content({}), parts({"parts"});
  ASSERT_EQ(log_->add_mesh("another", stored.sha256, content, parts), absl::OkStatus());
  ASSERT_EQ(log_->delete_mesh(stored.name), absl::OkStatus());
  log_ = nullptr;
  EXPECT_EQ(format_of(options_.path), kFormat);
  open();
  ASSERT_EQ(log_->stored_meshes().size(), 1u);
  EXPECT_FALSE(log_->stored_meshes()[0].parts_in_content);
  EXPECT_EQ(test::read_parts(*log_, "another").value(), std::vector<std::string>{"parts"});
  EXPECT_FALSE(read_mesh(*log_, stored.sha256)->empty());
}

TEST_F(RocksdbLogTest, AMeshWhosePartsCannotBeReadIsNotStored) {
  const test::ChunksFrom content({"content"});
  const auto parts = [] { return absl::StatusOr<std::optional<std::string>>(absl::CancelledError("enough")); };
  EXPECT_EQ(log_->add_mesh("a", hash_of(1), content, parts), absl::CancelledError("enough"));
  open();
  EXPECT_TRUE(log_->stored_meshes().empty());
  EXPECT_EQ(read_mesh(*log_, hash_of(1)).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(RocksdbLogTest, TopologyIsKeptBesideTheMeshAndGoesWithIt) {
  ASSERT_EQ(add_mesh("a", 1, {"content"}), absl::OkStatus());
  EXPECT_EQ(log_->read_topology(hash_of(1)), std::nullopt);
  log_->store_topology(hash_of(1), "topology");
  EXPECT_EQ(log_->read_topology(hash_of(1)), "topology");
  log_->store_topology(hash_of(1), "another");
  open();
  EXPECT_EQ(log_->read_topology(hash_of(1)), "another");
  EXPECT_EQ(log_->read_topology(hash_of(2)), std::nullopt);
  ASSERT_EQ(log_->delete_mesh("a"), absl::OkStatus());
  EXPECT_EQ(log_->read_topology(hash_of(1)), std::nullopt);
}

TEST_F(RocksdbLogTest, OpeningDeletesTopologiesWithoutMeshAndTemporaryFiles) {
  ASSERT_EQ(add_mesh("a", 1, {"content"}), absl::OkStatus());
  log_->store_topology(hash_of(1), "topology");
  log_->store_topology(hash_of(2), "of no mesh");
  const std::filesystem::path topologies = std::filesystem::path(options_.path) / "outlines";
  ASSERT_EQ(std::distance(std::filesystem::directory_iterator(topologies), {}), 2);
  test::write_file_bytes((topologies / (std::string(64, 'a') + ".new")).string(), "half of one");
  test::write_file_bytes((topologies / "of-somebody.svg").string(), "not ours");
  open();
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(topologies), {}), 2);
  EXPECT_TRUE(std::filesystem::exists(topologies / "of-somebody.svg"));
  EXPECT_EQ(log_->read_topology(hash_of(1)), "topology");
}

TEST_F(RocksdbLogTest, NoTopologyIsWrittenIntoTheReserve) {
  ASSERT_EQ(add_mesh("a", 1, {"content"}), absl::OkStatus());
  options_.reserve_bytes = ~uint64_t{0} / 2;
  open();
  log_->store_topology(hash_of(1), "topology");
  EXPECT_EQ(log_->read_topology(hash_of(1)), std::nullopt);
}

TEST_F(RocksdbLogTest, SecondOpenerIsRefused) {
  const auto second = RocksdbLog::open(options_);
  ASSERT_EQ(second.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(refusal_of(second.status())->reason, Reason::kInUse);
  EXPECT_THAT(second.status().message(), HasSubstr("in use"));
}

TEST_F(RocksdbLogTest, BackupOpensAsAnIndependentLog) {
  const SceneKey scene = create("a", 1);
  append(scene, 5);
  ASSERT_EQ(add_mesh("m", 1, {"content"}), absl::OkStatus());
  const std::string copy = folder_.file("copy");
  ASSERT_EQ(log_->back_up(copy), absl::OkStatus());
  EXPECT_EQ(log_->back_up(copy).code(), absl::StatusCode::kInvalidArgument);
  append(scene, 5);
  options_.path = copy;
  open();
  EXPECT_EQ(find_stored(*log_, "a")->damage, absl::OkStatus());
  expect_records(scene, 1, 5);
  EXPECT_EQ(read_mesh(*log_, hash_of(1)).value(), std::vector<std::string>{"content"});
  append(scene, 1);
}

TEST_F(RocksdbLogTest, CopiedScenesStayMarkedUntilTheyAreRestarted) {
  create("a", 1);
  create("b", 2);
  const std::string copy = folder_.file("copy");
  ASSERT_EQ(log_->back_up(copy), absl::OkStatus());
  open();
  EXPECT_FALSE(find_stored(*log_, "a")->copied) << "the original is not marked as copied";
  options_.path = copy;
  for (int time = 0; time < 2; ++time) {
    open();
    EXPECT_TRUE(find_stored(*log_, "a")->copied);
  }
  ASSERT_EQ(log_->restart_scene(1, 8), absl::OkStatus());
  open();
  EXPECT_FALSE(find_stored(*log_, "a")->copied);
  EXPECT_EQ(find_stored(*log_, "a")->epoch, 8u);
  EXPECT_TRUE(find_stored(*log_, "b")->copied);
}

TEST_F(RocksdbLogTest, SnapshotsFreeTheDiskSpaceOfTheLog) {
  options_.log_buffer_bytes = uint64_t{1} << 20;
  open();
  const SceneKey scene = create("a", 1);
  const auto size = [&] {
    uint64_t bytes = 0;
    for (const auto& file : std::filesystem::recursive_directory_iterator(options_.path)) {
      // RocksDB may delete a file in the background after the iterator has listed the file.
      std::error_code deleted;
      const uintmax_t file_bytes = file.is_regular_file(deleted) ? file.file_size(deleted) : 0;
      if (!deleted) bytes += file_bytes;
    }
    return bytes;
  };
  for (int round = 0; round < 4; ++round) {
    ASSERT_EQ(append_records(*log_, scene, 7, 200, AckLevel::kMemory, 200'000), absl::OkStatus());
    ASSERT_EQ(write_snapshot(*log_, scene, log_->latest(scene).value()), absl::OkStatus());
  }
  open();
  EXPECT_LT(size(), uint64_t{40} << 20) << "of 80 MB that were written";
}

// Runs one thread per scene that appends records, and one thread that writes snapshots of all scenes.
TEST_F(RocksdbLogTest, ConcurrentAppendsAndSnapshotsKeepEveryRecord) {
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
