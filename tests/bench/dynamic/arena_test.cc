#include "tests/bench/dynamic/arena.h"

#include <gtest/gtest.h>

namespace locus::bench::dynamic {
namespace {

TEST(ArenaTest, ReadersSeeEveryObjectOnceWhileAWriterMovesThem) {
  Arena arena(10'000);
  const Seen seen = arena.run({0.05, 2, Beside::kWriter, 1000, kUnpaced});
  EXPECT_FALSE(seen.latencies.empty());
  EXPECT_GT(seen.moves_a_second, 0);
  EXPECT_EQ(seen.wrong_counts, 0u);
}

TEST(ArenaTest, WithoutAWriterNoObjectMoves) {
  Arena arena(10'000);
  EXPECT_EQ(arena.run({0.01, 1, Beside::kSpinning}).moves_a_second, 0);
}

}  // namespace
}  // namespace locus::bench::dynamic
