#include "server/storage/integrity/repair.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "rocksdb/db.h"
#include "server/storage/integrity/durable_marker.h"
#include "server/storage/integrity/opening.h"
#include "server/storage/rocksdb_log.h"
#include "tests/support/faulty_files.h"
#include "tests/support/stored_log.h"

namespace locus::server {
namespace {

using test::hash_of;
using ::testing::HasSubstr;

class RepairTest : public ::testing::Test {
 protected:
  RepairTest() {
    options_.path = folder_.file("data");
    options_.reserve_bytes = 0;
  }

  std::unique_ptr<RocksdbLog> open() {
    auto log = RocksdbLog::open(options_);
    EXPECT_TRUE(log.ok()) << log.status();
    return log.ok() ? *std::move(log) : nullptr;
  }
  // Stores two meshes of equal content whose bytes are stored in a table, not in the log of RocksDB.
  void store_two_meshes() {
    std::unique_ptr<RocksdbLog> log = open();
    for (const std::string name : {"a", "b"}) {
      const test::ChunksFrom content({kFirst, kContent}), parts({kParts + name});
      ASSERT_EQ(log->add_mesh(name, hash_of(1), content, parts), absl::OkStatus());
    }
    log = nullptr;
    open();
  }
  // Returns the number of stored chunks of meshes, including chunks that no mesh uses.
  size_t stored_chunks() const {
    const std::string path = options_.path + "/rocksdb";
    std::vector<std::string> names;
    EXPECT_TRUE(rocksdb::DB::ListColumnFamilies(rocksdb::DBOptions(), path, &names).ok());
    std::vector<rocksdb::ColumnFamilyDescriptor> families;
    for (const std::string& name : names) families.emplace_back(name, rocksdb::ColumnFamilyOptions());
    std::vector<rocksdb::ColumnFamilyHandle*> handles;
    rocksdb::DB* raw = nullptr;
    EXPECT_TRUE(rocksdb::DB::OpenForReadOnly(rocksdb::DBOptions(), path, families, &handles, &raw).ok());
    const std::unique_ptr<rocksdb::DB> database(raw);
    size_t chunks = 0;
    for (rocksdb::ColumnFamilyHandle* const handle : handles) {
      const std::unique_ptr<rocksdb::Iterator> row(database->NewIterator(rocksdb::ReadOptions(), handle));
      // One row of the column family is not a chunk; its key is one byte. All other rows are chunks.
      for (row->SeekToFirst(); handle->GetName() == "mesh" && row->Valid(); row->Next())
        chunks += row->key().size() > 1;
      delete handle;
    }
    return chunks;
  }
  absl::StatusOr<RepairReport> damage_and_repair(const std::string& text) {
    test::flip_bit_of(text, options_.path + "/rocksdb");
    return repair(options_);
  }

  // Each value is larger than a block of a table, so that damage to one value does not make another value unreadable.
  const std::string kFirst = std::string(200'000, '-') + "the first chunk";
  const std::string kContent = "the only copy of the content" + std::string(200'000, '.');
  const std::string kParts = std::string(200'000, ',') + "the only copy of the parts of ";
  test::TemporaryFolder folder_;
  StorageOptions options_;
};

TEST_F(RepairTest, AMeshWhosePartsAreDamagedIsKeptWithoutThem) {
  store_two_meshes();
  EXPECT_EQ(stored_chunks(), 4u);
  ASSERT_EQ(open()->set_mesh_graces({"a", "b"}, 60), absl::OkStatus());
  const absl::StatusOr<RepairReport> report = damage_and_repair(kParts + "a");
  ASSERT_TRUE(report.ok()) << report.status();
  ASSERT_EQ(report->meshes.size(), 1u);
  EXPECT_FALSE(report->meshes[0].dropped);
  EXPECT_TRUE(report->meshes[0].parts_dropped);
  EXPECT_THAT(to_text(*report), HasSubstr("kept; LOST: the names of its parts"));
  EXPECT_EQ(stored_chunks(), 3u);
  const std::unique_ptr<RocksdbLog> log = open();
  ASSERT_EQ(log->stored_meshes().size(), 2u);
  EXPECT_EQ(test::read_mesh(*log, hash_of(1)).value(), (std::vector<std::string>{kFirst, kContent}));
  for (const StoredMesh& mesh : log->stored_meshes()) EXPECT_EQ(mesh.grace_s, 60u) << mesh.name;
  EXPECT_TRUE(test::read_parts(*log, "a")->empty());
  EXPECT_EQ(test::read_parts(*log, "b").value(), std::vector<std::string>{kParts + "b"});
}

TEST_F(RepairTest, MeshesWhoseContentIsDamagedAreDroppedWithTheirParts) {
  store_two_meshes();
  const absl::StatusOr<RepairReport> report = damage_and_repair(kContent);
  ASSERT_TRUE(report.ok()) << report.status();
  ASSERT_EQ(report->meshes.size(), 2u);
  EXPECT_TRUE(report->meshes[0].dropped && report->meshes[1].dropped);
  EXPECT_EQ(stored_chunks(), 0u) << "the first chunk was copied before the damaged one was read";
  EXPECT_TRUE(open()->stored_meshes().empty());
}

TEST_F(RepairTest, AFailureToReadTheDatabaseChangesNothing) {
  std::filesystem::create_directories(options_.path);
  const absl::StatusOr<RepairReport> nothing = repair(options_);
  EXPECT_EQ(nothing.status().code(), absl::StatusCode::kUnavailable) << nothing.status();
  EXPECT_FALSE(std::filesystem::exists(options_.path + "/" + std::string(kRepairedFolder)));
  EXPECT_NE(open(), nullptr);
}

TEST_F(RepairTest, ARepairThatWasInterruptedBeforeItsCommitIsStartedAgain) {
  store_two_meshes();
  const std::filesystem::path repaired = std::filesystem::path(options_.path) / std::string(kRepairedFolder);
  std::filesystem::create_directories(repaired);
  test::write_file_bytes((repaired / "READY").string(), "");
  const absl::StatusOr<RepairReport> report = repair(options_);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_FALSE(report->changed);
  EXPECT_FALSE(std::filesystem::exists(repaired));
  EXPECT_EQ(open()->stored_meshes().size(), 2u);
}

TEST_F(RepairTest, ARepairThatWasInterruptedIsFinishedAndReported) {
  store_two_meshes();
  // Make the files of a repair that was interrupted just before it would have moved the repaired database.
  const std::filesystem::path data = options_.path, repaired = data / std::string(kRepairedFolder);
  const std::string old = (data / "before-repair-1").string(), marker(DurableMarkerFile::kName);
  std::filesystem::create_directories(repaired);
  std::filesystem::copy(data / "rocksdb", repaired / "rocksdb", std::filesystem::copy_options::recursive);
  std::filesystem::copy(data / marker, repaired / marker);
  test::write_file_bytes((repaired / "READY").string(), old);
  test::flip_bit_of(kContent, options_.path + "/rocksdb");
  const absl::StatusOr<RepairReport> report = repair(options_);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->finished_at, old);
  EXPECT_FALSE(report->changed);
  EXPECT_THAT(to_text(*report), HasSubstr("the database before it is in " + old));
  EXPECT_TRUE(std::filesystem::exists(old + "/rocksdb"));
  EXPECT_EQ(open()->stored_meshes().size(), 2u);
}

}  // namespace
}  // namespace locus::server
