#include "tests/bench/frame/race.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"

namespace locus::bench {
namespace {

using ::testing::ElementsAre;

double now = 0;  // present time of the clock that these tests pass to race(), in seconds

double read_clock() { return now; }

Contestant taking(std::string name, double seconds, std::string& order) {
  const auto run = [name, seconds, &order](size_t chunk) {
    absl::StrAppend(&order, name, chunk);
    now += seconds;
  };
  return {name, run, 2, {}};
}

TEST(RaceTest, ContestantsTakeTurnsChunkByChunkAndTheFirstRoundDoesNotCount) {
  std::string order;
  const auto times = race({taking("a", 1, order), taking("b", 3, order)}, 2, 1, read_clock);
  EXPECT_EQ(order, "a0b0a1b1a0b0a1b1");
  EXPECT_THAT(times, ElementsAre(ElementsAre(1e9), ElementsAre(3e9)));
}

TEST(RaceTest, WarmContestantsRunNoWarmUpRound) {
  std::string order;
  race({taking("a", 1, order)}, 1, 2, read_clock, WarmUp::kDone);
  EXPECT_EQ(order, "a0a0");
}

TEST(RaceTest, PreparationIsNotTimed) {
  std::string order;
  Contestant one = taking("a", 1, order);
  one.prepare = [](size_t) { now += 100; };
  EXPECT_THAT(race({one}, 1, 3, read_clock), ElementsAre(ElementsAre(5e8, 5e8, 5e8)));
}

TEST(RaceTest, EachPeerGetsACellWithOursBesideIt) {
  std::string order;
  const std::vector<Contestant> contestants = {taking("us", 1, order), taking("p", 3, order), taking("q", 0.5, order)};
  Cell shared;
  shared.case_name = "case";
  Report report;
  add_cells(contestants, {{2, 4, 2}, {2, 2, 2}, {6, 6, 8}}, shared, report);
  ASSERT_EQ(report.cells.size(), 2u);
  EXPECT_EQ(report.cells[0].peer_name, "p");
  EXPECT_EQ(report.cells[0].ratio, 1);
  EXPECT_EQ(report.cells[0].spread, 0.5);
  EXPECT_EQ(report.cells[1].ours, 2);
  EXPECT_EQ(report.cells[1].peer, 6);
  EXPECT_EQ(report.cells[1].ratio, 3);
  EXPECT_EQ(report.cells[1].case_name, "case");
}

TEST(RaceTest, ClocksGoForward) {
  for (double (*clock)() : {thread_seconds, process_seconds, wall_seconds}) {
    const double before = clock();
    EXPECT_GE(clock(), before);
  }
}

}  // namespace
}  // namespace locus::bench
