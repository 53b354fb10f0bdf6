#include "client/cli/levels/generate/whole_root.h"

#include <gtest/gtest.h>

namespace locus::cli {
namespace {

TEST(WholeRootTest, ASquareGivesItsRootAndOneLessGivesTheRootMinusOne) {
  for (const uint64_t root : {1u, 2u, 3u, 1000u, 8192u, 65536u, 0x7FFFFFFFu}) {
    EXPECT_EQ(whole_root(root * root), root);
    EXPECT_EQ(whole_root(root * root - 1), root - 1);
    EXPECT_EQ(whole_root(root * root + 2 * root), root);
  }
  EXPECT_EQ(whole_root(0), 0u);
}

}  // namespace
}  // namespace locus::cli
