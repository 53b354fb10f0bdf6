// Runs a writer at full speed for ten minutes while readers compare the scene with a model. `tests/run.sh --long` runs
// this test; its log contains the line that the test writes at its end.
#include <gtest/gtest.h>

#include <chrono>
#include <iostream>

#include "tests/support/full_speed.h"

namespace locus::test {
namespace {

TEST(LongSceneProof, TenMinutesOfReadersThatCheckAModel) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(10);
  const FullSpeedResult result = run_at_full_speed(
      {20'000, 2, 4}, [end](const FullSpeedResult&) { return std::chrono::steady_clock::now() < end; });
  EXPECT_EQ(result.difference, "");
  std::cout << "proof: " << result.revisions
            << " revisions of 20000 objects, 1250 of them compounds, and of 64 doors in ten minutes, " << result.looks
            << " looks at them, " << result.past_looks
            << " at random past ticks: " << (result.difference.empty() ? "0 differences" : "") << "; seed 4\n";
}

}  // namespace
}  // namespace locus::test
