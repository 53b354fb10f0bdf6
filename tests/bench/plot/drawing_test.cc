#include "tests/bench/plot/drawing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"

namespace locus::bench {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

Record record_with(std::vector<Cell> cells) {
  return {
      .date = "2026-01-31", .machine = "it's a processor", .arguments = "static --quick", .cells = std::move(cells)};
}

Cell ratio_cell(const std::string& name, const std::string& peer, double ratio, double spread) {
  return {"static", name, "ns/ray", 100, 100 * ratio, peer, ratio, spread, "00ff"};
}

TEST(DrawingTest, TheIntervalHasTheLengthOfTheSpreadAndIsSymmetricOnALogarithmicAxis) {
  for (const double spread : {0.0, 0.1, 1.0, 5.0}) {
    const auto [low, high] = spread_around(3, spread);
    EXPECT_NEAR((high - low) / 3, spread, 1e-12);
    EXPECT_NEAR(low * high, 9, 1e-9);
    EXPECT_GT(low, 0);
  }
}

TEST(DrawingTest, RowsAreCasesAndColoursArePeers) {
  const std::vector<Drawing> drawings =
      ratio_drawings(record_with({ratio_cell("ray/a", "bullet", 2, 0.1), ratio_cell("ray/a", "cgal", 4, 0),
                                  ratio_cell("ball/a", "cgal", 0.5, 0)}));
  ASSERT_THAT(drawings, SizeIs(1));
  EXPECT_EQ(drawings[0].name, "static-ratios.svg");
  EXPECT_THAT(drawings[0].script, HasSubstr("set ytics ('ray/a' 0, 'ball/a' 1)"));
  EXPECT_THAT(drawings[0].script,
              HasSubstr("$peer0 << END\n2 1.902 2.102 0\nEND\n$peer1 << END\n4 4 4 0\n0.5 0.5 0.5 1\nEND\n"));
  EXPECT_THAT(drawings[0].script, HasSubstr("title 'bullet'"));
}

TEST(DrawingTest, TheDateTheMachineAndTheArgumentsAreInThePicture) {
  const std::string script = ratio_drawings(record_with({ratio_cell("ray/a", "bullet", 2, 0)})).front().script;
  EXPECT_THAT(script, HasSubstr("'locus-bench static --quick  (2026-01-31; it''s a processor)'"));
}

TEST(DrawingTest, ManyCasesNeedFurtherPictures) {
  std::vector<Cell> cells;
  for (size_t i = 0; i <= kMaxRows; ++i) cells.push_back(ratio_cell(absl::StrCat("ray/", i), "bullet", 2, 0));
  const std::vector<Drawing> drawings = ratio_drawings(record_with(cells));
  ASSERT_THAT(drawings, SizeIs(2));
  EXPECT_EQ(drawings[1].name, "static-ratios-2.svg");
  EXPECT_THAT(drawings[1].script, HasSubstr(absl::StrCat("set ytics ('ray/", kMaxRows, "' 0)")));
}

TEST(DrawingTest, ExponentsAreNotDrawnAsRatios) {
  Cell exponent = ratio_cell("exponent/ray/bvh/uniform", "list", 8, 0);
  exponent.metric = "exponent";
  EXPECT_THAT(ratio_drawings(record_with({exponent})), SizeIs(0));
}

TEST(DrawingTest, TimesOfStructuresAreDrawnAgainstTheirCounts) {
  std::vector<Cell> cells;
  for (const char* count : {"10", "1e2", "1e3"}) {
    for (const char* structure : {"bvh", "grid"}) {
      Cell cell = ratio_cell(absl::StrCat("ball/", structure, "/uniform/", count), "list", 2, 0);
      cell.metric = "ns/query";
      cells.push_back(cell);
    }
  }
  const std::vector<Drawing> drawings = growth_drawings(record_with(cells));
  ASSERT_THAT(drawings, SizeIs(1));
  EXPECT_EQ(drawings[0].name, "static-growth.svg");
  EXPECT_THAT(drawings[0].script, HasSubstr("END\n10 100\n100 100\n1000 100\nEND\n"));
  EXPECT_THAT(drawings[0].script, HasSubstr("10 200\n100 200\n1000 200\n"));
  EXPECT_THAT(drawings[0].script, HasSubstr("set title 'ball/uniform'"));
  EXPECT_THAT(drawings[0].script, HasSubstr("title 'list'"));
}

TEST(DrawingTest, TwoCountsAreNoGrowth) {
  std::vector<Cell> cells;
  for (const char* count : {"1e3", "1e4"}) {
    cells.push_back(ratio_cell(absl::StrCat("ball/bvh/uniform/", count), "list", 2, 0));
    cells.back().metric = "ns/query";
  }
  EXPECT_THAT(growth_drawings(record_with(cells)), SizeIs(0));
}

TEST(DrawingTest, AFailureOfGnuplotIsReported) {
  const absl::Status status =
      draw(record_with({ratio_cell("ray/a", "bullet", 2, 0)}), "/bin/false", testing::TempDir()).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInternal);
  EXPECT_THAT(std::string(status.message()), HasSubstr("gnuplot failed"));
}

}  // namespace
}  // namespace locus::bench
