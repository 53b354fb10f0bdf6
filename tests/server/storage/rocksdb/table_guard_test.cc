#include "server/storage/rocksdb/table_guard.h"

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
    for (int key = 100; key < 120; ++key) EXPECT_TRUE(writer.Put(absl::StrCat(key), "value").ok());
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

// From the block of properties on, which is the first that RocksDB trusts too early, up to the footer's first place:
// the kind of checksums. The rest of the footer RocksDB compares before it trusts any of it.
TEST_F(TableGuardTest, AnyByteTurnedFromThePropertiesToTheFooterKeepsItShut) {
  const size_t properties = bytes_.find("rocksdb.block.based.table.index.type");
  ASSERT_NE(properties, std::string::npos);
  constexpr size_t kFooterBytes = 53;
  ASSERT_LT(properties + 500, bytes_.size() - kFooterBytes) << "the properties and the list of blocks";
  for (size_t place = properties; place <= bytes_.size() - kFooterBytes; ++place) {
    std::string wrong = bytes_;
    wrong[place] = static_cast<char>(wrong[place] ^ (1 << place % 8));
    ASSERT_FALSE(opens(wrong)) << place;
  }
}

TEST_F(TableGuardTest, AFooterThatPointsElsewhereKeepsItShut) {
  size_t at = bytes_.size() - 52;  // behind the kind of checksums: where the list of blocks is, and its length
  for (int number = 0; number < 2; ++number) {
    for (bool more = true; more; ++at) {
      std::string wrong = bytes_;
      wrong[at] = static_cast<char>(wrong[at] ^ 1);
      ASSERT_FALSE(opens(wrong)) << at;
      more = (bytes_[at] & 0x80) != 0;
    }
  }
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
