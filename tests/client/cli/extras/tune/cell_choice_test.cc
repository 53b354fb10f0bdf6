#include "client/cli/extras/tune/cell_choice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace locus::cli {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

SizeFigures figures_of(double setting, double relative, bool is_present = false) {
  SizeFigures figures;
  figures.setting = setting;
  figures.cell_size = setting == 0 ? 8 : setting;
  figures.relative = relative;
  figures.is_present = is_present;
  return figures;
}

TEST(CellChoiceTest, TheFastestSizeIsNamedWithItsGain) {
  const SizeFigures figures[] = {figures_of(0, 1, true), figures_of(4, 0.6), figures_of(16, 0.8)};
  const SizeChoice choice = choose_size(figures, 0);
  EXPECT_EQ(choice.index, 1u);
  EXPECT_EQ(choice.cell_size, 4);
  EXPECT_THAT(choice.gain_percent, DoubleNear(40, 1e-9));
  EXPECT_FALSE(choice.leave_it);
}

TEST(CellChoiceTest, AGainBelowTenPercentIsLeft) {
  const SizeFigures small[] = {figures_of(0, 1, true), figures_of(4, 0.901)};
  EXPECT_TRUE(choose_size(small, 0).leave_it);
  EXPECT_EQ(choose_size(small, 0).index, 1u) << "the figure is still told";
  const SizeFigures enough[] = {figures_of(0, 1, true), figures_of(4, 0.899)};
  EXPECT_FALSE(choose_size(enough, 0).leave_it);
}

TEST(CellChoiceTest, OnlyAConfirmedSizeIsNamed) {
  SizeFigures lucky = figures_of(4, 0.5);
  lucky.is_confirmed = false;
  const SizeFigures figures[] = {lucky, figures_of(8, 0.8), figures_of(64, 1, true)};
  EXPECT_EQ(choose_size(figures, 64).cell_size, 8);
}

TEST(CellChoiceTest, TheServersChoiceIsNotPreferredIfOnlyTheOtherSizeIsWorthAChange) {
  const SizeFigures figures[] = {figures_of(64, 1, true), figures_of(0, 0.92), figures_of(4, 0.88)};
  const SizeChoice choice = choose_size(figures, 64);
  EXPECT_EQ(choice.cell_size, 4);
  EXPECT_FALSE(choice.leave_it);
}

TEST(CellChoiceTest, ThePresentSizeIsLeftIfAllOthersAreSlower) {
  const SizeFigures figures[] = {figures_of(2, 1, true), figures_of(0, 1.5), figures_of(4, 1.2)};
  const SizeChoice choice = choose_size(figures, 2);
  EXPECT_EQ(choice.index, 0u);
  EXPECT_TRUE(choice.leave_it);
  EXPECT_EQ(choice.gain_percent, 0);
}

TEST(CellChoiceTest, TheServersChoiceIsPreferredToASlightlyBetterSize) {
  const SizeFigures close[] = {figures_of(64, 1, true), figures_of(0, 0.52), figures_of(4, 0.5)};
  const SizeChoice choice = choose_size(close, 64);
  EXPECT_EQ(choice.cell_size, 0);
  EXPECT_THAT(choice.gain_percent, DoubleNear(48, 1e-9));
  EXPECT_FALSE(choice.leave_it);
  const SizeFigures apart[] = {figures_of(64, 1, true), figures_of(0, 0.53), figures_of(4, 0.5)};
  EXPECT_EQ(choose_size(apart, 64).cell_size, 4);
}

TEST(CellChoiceTest, ASizeThatTheServerWouldChooseOnlyInANewSceneIsNamedAsFixed) {
  const SizeFigures figures[] = {figures_of(0, 0.5), figures_of(64, 1, true)};
  EXPECT_EQ(choose_size(figures, 0).cell_size, 8) << "the server keeps the size that it chose before";
  EXPECT_EQ(choose_size(figures, 64).cell_size, 0);
}

TEST(CellChoiceTest, KindsCountByTheirQueriesOrAlike) {
  const std::map<std::string, KindCost> present = {{"balls", {100, 1}}, {"rays", {10'000, 1}}};
  const std::map<std::string, KindCost> other = {{"balls", {50, 1}}, {"rays", {10'000, 1}}};
  const KindWeights alike = equal_weights(present);
  EXPECT_THAT(weighted_time(other, alike) / weighted_time(present, alike), DoubleNear(0.75, 1e-9));
  const KindWeights by_number = {{"balls", 900}, {"rays", 1}};
  EXPECT_THAT(weighted_time(other, by_number) / weighted_time(present, by_number), DoubleNear(0.55, 1e-9));
}

TEST(CellChoiceTest, TheSearchBeginsWithEverySecondSizeAroundThePresentOne) {
  EXPECT_THAT(next_exponents({}, 3), ElementsAre(-1, 1, 3, 5, 7));
  EXPECT_THAT(next_exponents({}, kMaxExponent), ElementsAre(27, 29, 31));
  EXPECT_THAT(next_exponents({}, kMinExponent), ElementsAre(-20, -18, -16));
}

// Returns the size at which the search ends if `time` is the time at each exponent, and the number of measured sizes.
template <class Time>
std::pair<int, size_t> end_of_search(int present, const Time& time) {
  std::map<int, double> times;
  for (std::vector<int> next = next_exponents(times, present); !next.empty(); next = next_exponents(times, present))
    for (const int exponent : next) times[exponent] = time(exponent);
  int best = times.begin()->first;
  for (const auto& [exponent, value] : times)
    if (value < times[best]) best = exponent;
  return {best, times.size()};
}

TEST(CellChoiceTest, TheSearchFindsTheBestOfAValleyWithoutASweep) {
  for (int best = -6; best <= 12; ++best) {
    const auto [found, measured] =
        end_of_search(3, [best](int exponent) { return std::exp2(std::abs(exponent - best)); });
    EXPECT_EQ(found, best);
    EXPECT_LE(measured, 14u);
  }
}

TEST(CellChoiceTest, TheSearchEndsAtTheBordersAndOnAPlain) {
  EXPECT_EQ(end_of_search(0, [](int exponent) { return -exponent; }).first, kSearchReach);
  EXPECT_EQ(end_of_search(0, [](int exponent) { return exponent; }).first, -kSearchReach);
  EXPECT_EQ(end_of_search(30, [](int exponent) { return -exponent; }).first, kMaxExponent);
  EXPECT_LE(end_of_search(0, [](int) { return 1; }).second, 10u);
  EXPECT_THAT(next_exponents({{3, 1.0}, {2, 2.0}, {4, 2.0}}, 3), IsEmpty());
}

}  // namespace
}  // namespace locus::cli
