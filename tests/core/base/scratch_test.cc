#include "core/base/scratch.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace locus {
namespace {

TEST(ScratchTest, ClearKeepsTheMemoryOfASmallVectorAndFreesThatOfALargeOne) {
  std::vector<uint64_t> small(100), large(kKeptScratch / sizeof(uint64_t) + 1);
  clear_scratch(small);
  clear_scratch(large);
  EXPECT_TRUE(small.empty());
  EXPECT_GE(small.capacity(), 100u);
  EXPECT_TRUE(large.empty());
  EXPECT_EQ(large.capacity(), 0u);
}

}  // namespace
}  // namespace locus
