#include "core/base/large_array.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace locus::test {
namespace {

bool is_aligned(const void* memory, size_t alignment) { return reinterpret_cast<uintptr_t>(memory) % alignment == 0; }

struct alignas(64) Line {
  uint32_t words[16];
};

TEST(LargeArrayTest, AllElementsKeepTheirValues) {
  constexpr size_t kCount = kLargeArray / sizeof(Line) + 3;
  const LargeArray<Line> lines = make_large_array<Line>(kCount);
  for (size_t i = 0; i < kCount; ++i) lines[i].words[15] = static_cast<uint32_t>(i);
  for (size_t i = 0; i < kCount; ++i) ASSERT_EQ(lines[i].words[15], i);
}

TEST(LargeArrayTest, MemoryHasTheAlignmentOfTheElements) {
  EXPECT_TRUE(is_aligned(make_large_array<Line>(3).get(), alignof(Line)));
}

TEST(LargeArrayTest, ALargeArrayBeginsOnALargePage) {
  EXPECT_TRUE(is_aligned(make_large_array<uint32_t>(kLargeArray / 4).get(), kLargePage));
}

TEST(LargeArrayTest, OnlyLargeArraysAreMappingsOfTheirOwn) {
  const uint64_t before = mapped_array_bytes();
  {
    const LargeArray<char> large = make_large_array<char>(kLargeArray + 1);
    large[kLargeArray] = 'x';
    const LargeArray<char> mapped = make_large_array<char>(kMappedArray);
    mapped[kMappedArray - 1] = 'x';
    const LargeArray<char> small = make_large_array<char>(kMappedArray - 1);
    EXPECT_EQ(mapped_array_bytes(), before + kLargeArray + 1 + kMappedArray);
  }
  EXPECT_EQ(mapped_array_bytes(), before);
}

TEST(LargeArrayTest, AnEmptyArrayHasMemory) { EXPECT_NE(make_large_array<uint32_t>(0).get(), nullptr); }

}  // namespace
}  // namespace locus::test
