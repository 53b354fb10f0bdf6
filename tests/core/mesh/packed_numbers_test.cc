#include "core/mesh/packed_numbers.h"

#include <gtest/gtest.h>

#include <limits>

namespace locus::test {
namespace {

TEST(PackedNumbersTest, ElementsKeepTheirValues) {
  for (const uint32_t largest : {1u, 255u, 256u, 65'535u, 65'536u, (1u << 24) - 1, 1u << 24, 0xFFFFFFFFu}) {
    PackedNumbers numbers(3, largest);
    numbers.set(2, largest);
    numbers.set(0, largest - 1);
    EXPECT_EQ(numbers[0], largest - 1);
    EXPECT_EQ(numbers[1], 0u);
    EXPECT_EQ(numbers[2], largest);
  }
}

TEST(PackedNumbersTest, EachElementTakesTheBytesOfTheLargest) {
  EXPECT_EQ(PackedNumbers(100, 255).bytes(), 100u);
  EXPECT_EQ(PackedNumbers(100, 256).bytes(), 200u);
  EXPECT_EQ(PackedNumbers(100, 1u << 16).bytes(), 300u);
  EXPECT_EQ(PackedNumbers(100, 1u << 24).bytes(), 400u);
}

TEST(PackedNumbersTest, AnArrayOfZerosTakesNoMemory) {
  const PackedNumbers zeros(100, 0);
  EXPECT_EQ(zeros[99], 0u);
  EXPECT_EQ(zeros.bytes(), 0u);
}

}  // namespace
}  // namespace locus::test
