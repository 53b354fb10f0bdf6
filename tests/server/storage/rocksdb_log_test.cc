#include "server/storage/rocksdb_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "core/base/refusal.h"
#include "rocksdb/db.h"
#include "server/storage/rocksdb/rows.h"
#include "tests/support/faulty_files.h"
#include "tests/support/log_fixture.h"

namespace locus::server {
namespace {

using test::append_records;
using test::find_stored;
using test::hash_of;
using test::read_mesh;
using test::write_snapshot;
using ::testing::HasSubstr;

class RocksdbLogTest : public test::LogFixture {
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

  test::TemporaryFolder folder_;
  StorageOptions options_;
};

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

}  // namespace
}  // namespace locus::server
