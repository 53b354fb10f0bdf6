#include "client/cli/extras/tune/tune_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace locus::cli {
namespace {

using ::testing::HasSubstr;

CellTuningResult result_with(double cell_size, double gain_percent) {
  CellTuningResult result;
  SizeFigures& present = result.figures.emplace_back();
  present.cell_size = present.setting = 64;
  present.is_present = true;
  SizeFigures& other = result.figures.emplace_back();
  other.cell_size = other.setting = cell_size;
  other.relative = 1 - gain_percent / 100;
  result.choice = choose_size(result.figures, 64);
  return result;
}

TEST(TuneReportTest, TheAdvisedCommandHasAllDigitsOfTheSize) {
  EXPECT_THAT(advice("arena", result_with(0x1p20, 40)), HasSubstr("arena --cell-size 1048576` makes"));
  EXPECT_THAT(advice("arena", result_with(0x1p-12, 40)), HasSubstr("--cell-size 0.000244140625` makes"));
  EXPECT_THAT(advice("arena", result_with(0x1p-12, 40)), HasSubstr("40 % less time"));
}

TEST(TuneReportTest, AGainBelowTenPercentIsToldButNotAdvised) {
  EXPECT_EQ(advice("arena", result_with(32, 8)), "leave it: the best cell size, 32, would save only 8 % of the time");
  EXPECT_EQ(advice("arena", result_with(32, -8)), "leave it: no other cell size makes these queries clearly faster");
}

}  // namespace
}  // namespace locus::cli
