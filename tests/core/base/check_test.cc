#include "core/base/check.h"

#include <algorithm>
#include <limits>

#include "gtest/gtest.h"

namespace locus {
namespace {

TEST(CheckDeathTest, AFailedComparisonPrintsBothOperandsFileAndLine) {
  const int stored = 3, counted = 4;
  EXPECT_DEATH(LOCUS_CHECK_EQ(stored, counted), "check_test.cc:[0-9]+: check failed: stored == counted with 3 and 4");
  EXPECT_DEATH(LOCUS_CHECK_NE(stored, 3), "stored != 3 with 3 and 3");
  EXPECT_DEATH(LOCUS_CHECK_LE(counted, stored), "counted <= stored with 4 and 3");
  EXPECT_DEATH(LOCUS_CHECK_LT(stored, stored), "stored < stored with 3 and 3");
  EXPECT_DEATH(LOCUS_CHECK_LE(counted, std::min(counted, 2)), "with 4 and 2") << "std::min returns a temporary here";
}

TEST(CheckDeathTest, AFailedCheckPrintsItsCondition) {
  const bool sorted = false;
  EXPECT_DEATH(LOCUS_CHECK(sorted), "check failed: sorted");
}

TEST(CheckTest, PassedChecksEvaluateOperandsOnceAndPrintNothing) {
  int calls = 0;
  const auto next = [&calls] { return ++calls; };
  LOCUS_CHECK_EQ(next(), 1);
  LOCUS_CHECK_LT(next(), 3);
  LOCUS_CHECK(next() == 3);
  EXPECT_EQ(calls, 3);
}

// Every ordered comparison with NaN is false, so each ordered check of a NaN fails.
TEST(CheckDeathTest, NanFailsEveryOrderedComparison) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_DEATH(LOCUS_CHECK_LE(nan, 1.0), "nan and 1");
  EXPECT_DEATH(LOCUS_CHECK_LE(1.0, nan), "1 and nan");
}

// Release builds compile the operands of a LOCUS_DCHECK but do not evaluate them.
TEST(CheckDeathTest, DebugChecksAbortIfEnabledAndEvaluateNothingOtherwise) {
  int calls = 0;
  const auto next = [&calls] { return ++calls; };
  if constexpr (kDebugChecks) {
    EXPECT_DEATH(LOCUS_DCHECK_EQ(next(), 2), "next\\(\\) == 2 with 1 and 2");
    EXPECT_DEATH(LOCUS_DCHECK_GE(next(), 2), "next\\(\\) >= 2 with 1 and 2");
    EXPECT_DEATH(LOCUS_DCHECK_GT(next(), 1), "next\\(\\) > 1 with 1 and 1");
    EXPECT_DEATH(LOCUS_DCHECK_NE(next(), 1), "next\\(\\) != 1 with 1 and 1");
    EXPECT_DEATH(LOCUS_DCHECK_LE(next(), 0), "next\\(\\) <= 0 with 1 and 0");
    EXPECT_DEATH(LOCUS_DCHECK_LT(next(), 1), "next\\(\\) < 1 with 1 and 1");
    EXPECT_DEATH(LOCUS_DCHECK(next() == 2), "check failed: next\\(\\) == 2");
    LOCUS_DCHECK_CALL(next());
    EXPECT_EQ(calls, 1);
  } else {
    LOCUS_DCHECK_EQ(next(), 2);
    LOCUS_DCHECK(next() == 2);
    LOCUS_DCHECK_CALL(next());
    EXPECT_EQ(calls, 0);
  }
}

}  // namespace
}  // namespace locus
