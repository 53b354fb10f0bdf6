#include "server/storage/table_guard.h"

#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"
#include "rocksdb/sst_file_writer.h"
#include "tests/support/faulty_files.h"
#include "tests/support/temporary_folder.h"

namespace locus::server {
namespace {

class TableGuardTest : public ::testing::Test {
 protected:
  TableGuardTest() {
    rocksdb::SstFileWriter writer(rocksdb::EnvOptions{}, rocksdb::Options{});
    EXPECT_TRUE(writer.Open(path_).ok());
    for (int key = 100; key < 300; ++key) EXPECT_TRUE(writer.Put(absl::StrCat(key), std::string(100, 'v')).ok());
    EXPECT_TRUE(writer.Finish().ok());
    bytes_ = test::file_bytes(path_);
  }

  // Whether the guard lets a table of these bytes be opened.
  bool opens(const std::string& bytes) {
    test::write_file_bytes(path_, bytes);
    std::unique_ptr<rocksdb::FSRandomAccessFile> file;
    const rocksdb::IOStatus status = guard_.NewRandomAccessFile(path_, rocksdb::FileOptions(), &file, nullptr);
    EXPECT_EQ(status.ok(), file != nullptr);
    EXPECT_TRUE(status.ok() || status.IsCorruption()) << status.ToString();
    return status.ok();
  }

  const test::TemporaryFolder folder_;
  const std::string path_ = folder_.file("000007.sst");
  TableGuard guard_{rocksdb::FileSystem::Default()};
  std::string bytes_;
};

TEST_F(TableGuardTest, SoundTableOpens) { EXPECT_TRUE(opens(bytes_)); }

// From the block of properties on, which is the first that RocksDB trusts too early.
TEST_F(TableGuardTest, AnyBitTurnedInPropertiesListOrFooterKeepsItShut) {
  const size_t properties = bytes_.find("rocksdb.block.based.table.index.type");
  ASSERT_NE(properties, std::string::npos);
  size_t open = 0;
  for (size_t place = properties; place < bytes_.size(); ++place) {
    std::string wrong = bytes_;
    wrong[place] = static_cast<char>(wrong[place] ^ (1 << place % 8));
    open += opens(wrong) ? 1 : 0;
  }
  // In the footer: where the index is, zeros, version and magic number, which RocksDB compares itself.
  EXPECT_LT(open, 53u);
}

TEST_F(TableGuardTest, NoCutTableOpens) {
  for (size_t size = 0; size < bytes_.size(); ++size) ASSERT_FALSE(opens(bytes_.substr(0, size))) << size;
}

TEST_F(TableGuardTest, OtherFilesAreNotLookedAt) {
  const std::string log = folder_.file("000008.log");
  test::write_file_bytes(log, "anything");
  std::unique_ptr<rocksdb::FSRandomAccessFile> file;
  EXPECT_TRUE(guard_.NewRandomAccessFile(log, rocksdb::FileOptions(), &file, nullptr).ok());
}

}  // namespace
}  // namespace locus::server
