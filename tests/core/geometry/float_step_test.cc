#include "core/geometry/float_step.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/random.h"

namespace locus::test {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

void expect_as_nextafter(uint32_t bits) {
  const auto value = std::bit_cast<float>(bits);
  if (std::isnan(value)) {
    EXPECT_TRUE(std::isnan(next_above(value))) << bits;
    return;
  }
  ASSERT_EQ(std::bit_cast<uint32_t>(next_above(value)), std::bit_cast<uint32_t>(std::nextafter(value, kInfinity)))
      << bits;
}

TEST(FloatStepTest, StepsAtTheEndsOfEveryExponentEqualNextafter) {
  for (uint32_t high = 0; high < 512; ++high) {
    for (const uint32_t low : {0u, 1u, 2u, 0x3FFFFFu, 0x400000u, 0x7FFFFEu, 0x7FFFFFu})
      expect_as_nextafter(high << 23 | low);
  }
}

TEST(FloatStepTest, AMillionRandomStepsEqualNextafter) {
  Random random(1);
  for (int i = 0; i < 1'000'000; ++i) expect_as_nextafter(static_cast<uint32_t>(random.next() >> 32));
}

}  // namespace
}  // namespace locus::test
