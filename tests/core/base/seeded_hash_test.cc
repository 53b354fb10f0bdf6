#include "core/base/seeded_hash.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <functional>

#include "tests/support/random.h"

namespace locus::test {
namespace {

TEST(SeededHashTest, HashIsConstantWithinAProcess) {
  EXPECT_EQ(SeededHash()(12345), SeededHash()(12345));
  EXPECT_NE(SeededHash()(12345), SeededHash()(12346));
}

TEST(SeededHashTest, DifferentSeedsGiveDifferentHashes) {
  EXPECT_NE(SeededHash({1, 99})(12345), SeededHash({2, 99})(12345));
  EXPECT_NE(SeededHash({1, 99})(12345), SeededHash({1, 101})(12345));
}

// Typical ids are counters, addresses, bit fields and multiplicative hashes.
TEST(SeededHashTest, RegularIdsSpreadOverTheUpperBits) {
  const std::array<std::function<uint64_t(uint64_t)>, 5> patterns = {
      [](uint64_t i) { return i + 1; }, [](uint64_t i) { return i << 20; }, [](uint64_t i) { return i << 50; },
      [](uint64_t i) { return (i & 0xff) << 56 | i >> 8; }, [](uint64_t i) { return i * 0x9E3779B97F4A7C15; }};
  Random random(1);
  for (int seed = 0; seed < 20; ++seed) {
    const SeededHash hash({random.next(), random.next()});
    for (size_t pattern = 0; pattern < patterns.size(); ++pattern) {
      std::array<uint32_t, 4096> counts{};
      for (uint64_t i = 0; i < 3 * counts.size(); ++i) ++counts[hash(patterns[pattern](i)) >> 52];
      EXPECT_LT(*std::max_element(counts.begin(), counts.end()), 25u) << seed << " " << pattern;  // typically 15
    }
  }
}

}  // namespace
}  // namespace locus::test
