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

  // Returns whether the guard opens a table file that contains `bytes`.
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

TEST_F(TableGuardTest, IntactTableOpens) { EXPECT_TRUE(opens(bytes_)); }

// Flips a bit of each byte from the properties block to the checksum type. RocksDB reads the properties block before it
// verifies this block. The checksum type is the first byte of the footer; RocksDB itself verifies the other bytes of
// the footer.
TEST_F(TableGuardTest, AnyFlippedByteFromPropertiesToFooterIsRefused) {
  const size_t properties = bytes_.find("rocksdb.block.based.table.index.type");
  ASSERT_NE(properties, std::string::npos);
  constexpr size_t kFooterBytes = 53;
  ASSERT_LT(properties + 500, bytes_.size() - kFooterBytes) << "the properties and the list of blocks";
  for (size_t position = properties; position <= bytes_.size() - kFooterBytes; ++position) {
    std::string wrong = bytes_;
    wrong[position] = static_cast<char>(wrong[position] ^ (1 << position % 8));
    ASSERT_FALSE(opens(wrong)) << position;
  }
}

TEST_F(TableGuardTest, FooterWithWrongPositionsIsRefused) {
  size_t at = bytes_.size() - 52;  // position after the checksum type: offset and length of the metaindex block
  for (int varint = 0; varint < 2; ++varint) {
    for (bool more = true; more; ++at) {
      std::string wrong = bytes_;
      wrong[at] = static_cast<char>(wrong[at] ^ 1);
      ASSERT_FALSE(opens(wrong)) << at;
      more = (bytes_[at] & 0x80) != 0;
    }
  }
}

TEST_F(TableGuardTest, TruncatedTableIsRefused) {
  for (size_t size = 0; size < bytes_.size(); ++size) ASSERT_FALSE(opens(bytes_.substr(0, size))) << size;
}

TEST_F(TableGuardTest, OtherFilesAreNotChecked) {
  const std::string log = folder_.file("000008.log");
  test::write_file_bytes(log, "anything");
  std::unique_ptr<rocksdb::FSRandomAccessFile> file;
  EXPECT_TRUE(guard_.NewRandomAccessFile(log, rocksdb::FileOptions(), &file, nullptr).ok());
}

}  // namespace
}  // namespace locus::server
