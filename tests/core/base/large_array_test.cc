#include "core/base/large_array.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace locus::test {
namespace {

bool stands_at_multiple_of(const void* memory, size_t step) { return reinterpret_cast<uintptr_t>(memory) % step == 0; }

struct alignas(64) Line {
  uint32_t numbers[16];
};

TEST(LargeArrayTest, HoldsWhatIsWrittenFromTheFirstToTheLast) {
  constexpr size_t kCount = kLargeArray / sizeof(Line) + 3;
  const LargeArray<Line> lines = make_large_array<Line>(kCount);
  for (size_t i = 0; i < kCount; ++i) lines[i].numbers[15] = static_cast<uint32_t>(i);
  for (size_t i = 0; i < kCount; ++i) ASSERT_EQ(lines[i].numbers[15], i);
}

TEST(LargeArrayTest, StandsAsItsValuesAsk) {
  EXPECT_TRUE(stands_at_multiple_of(make_large_array<Line>(3).get(), alignof(Line)));
}

TEST(LargeArrayTest, BeginsOnALargePageWhereItIsLarge) {
  EXPECT_TRUE(stands_at_multiple_of(make_large_array<uint32_t>(kLargeArray / 4).get(), kLargePage));
}

TEST(LargeArrayTest, MayBeEmpty) { EXPECT_NE(make_large_array<uint32_t>(0).get(), nullptr); }

}  // namespace
}  // namespace locus::test
