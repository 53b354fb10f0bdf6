#include "tests/bench/log/raw_file.h"

#include <gtest/gtest.h>

#include "tests/bench/frame/temporary_folder.h"

namespace locus::bench::log {
namespace {

TEST(RawFileTest, HoldsTheAppendedRecordsWithAndWithoutReservedSpace) {
  const TemporaryFolder folder;
  for (const uint64_t reserved : {uint64_t{0}, uint64_t{1} << 20}) {
    const auto file = RawFile::create(folder.file(std::to_string(reserved)), reserved);
    ASSERT_TRUE(file.ok()) << file.status();
    EXPECT_EQ(*(*file)->read_all(), "");
    ASSERT_TRUE((*file)->append("one").ok());
    ASSERT_TRUE((*file)->append("two").ok());
    EXPECT_EQ(*(*file)->read_all(), "onetwo");
  }
}

TEST(RawFileTest, AFileThatCannotBeCreatedIsAnError) {
  const TemporaryFolder folder;
  EXPECT_FALSE(RawFile::create(folder.file("no/such/folder"), 0).ok());
}

}  // namespace
}  // namespace locus::bench::log
