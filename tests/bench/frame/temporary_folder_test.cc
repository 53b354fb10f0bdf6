#include "tests/bench/frame/temporary_folder.h"

#include <gtest/gtest.h>

#include <fstream>

namespace locus::bench {
namespace {

TEST(TemporaryFolderTest, IsRemovedWithItsContent) {
  std::string file;
  {
    const TemporaryFolder folder;
    file = folder.file("file");
    std::ofstream(file) << "text";
    ASSERT_TRUE(std::filesystem::exists(file));
  }
  EXPECT_FALSE(std::filesystem::exists(std::filesystem::path(file).parent_path()));
}

}  // namespace
}  // namespace locus::bench
