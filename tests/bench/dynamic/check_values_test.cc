#include "tests/bench/dynamic/check_values.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace locus::bench::dynamic {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Returns answers that have `ids` ids in total, each at `distance`.
Answers answers_of(size_t ids, float distance) {
  Answers answers;
  answers.ids.assign(ids, 1);
  answers.distances.assign(ids, distance);
  answers.counts.assign(kQueries, 0);
  return answers;
}

TEST(CheckValuesTest, KnownSumsPass) {
  const World world(Kind::kUniform, 10'000);
  Report report;
  check_values("ball", Task::kBall, world, {}, "peer", answers_of(9'700, 0), report);
  check_values("ray", Task::kRay, world, {}, "peer", answers_of(58, 1131.4f / 58), report);
  EXPECT_THAT(report.disagreements, IsEmpty());
}

TEST(CheckValuesTest, OtherSumsAreDisagreements) {
  const World world(Kind::kUniform, 10'000);
  Report report;
  check_values("ball", Task::kBall, world, {}, "peer", answers_of(9'500, 0), report);
  check_values("ray", Task::kRay, world, {}, "peer", answers_of(58, 20), report);
  EXPECT_THAT(report.disagreements, ElementsAre(HasSubstr("ball, peer: ids a ball is 0.9500, and must be 0.9700"),
                                                HasSubstr("sum of distances is 1160.0000")));
}

TEST(CheckValuesTest, NearestSumsUseDistancesToCentres) {
  const World world(Kind::kUniform, 10'000);
  const Queries queries = queries_of(world);
  Answers answers;
  answers.ids.assign(kQueries, world.objects().ids[0]);
  answers.counts.assign(kQueries, 1);
  Report report;
  check_values("nearest", Task::kNearest, world, queries, "peer", answers, report);
  ASSERT_EQ(report.disagreements.size(), 1u);
  EXPECT_THAT(report.disagreements[0], HasSubstr("sum of distances to centres is"));
  EXPECT_THAT(report.disagreements[0], HasSubstr("must be 2419380.3"));
}

TEST(CheckValuesTest, WorldsWithoutKnownValuesPass) {
  Report report;
  check_values("ball", Task::kBall, World(Kind::kFar, 10'000), {}, "peer", answers_of(1, 0), report);
  EXPECT_THAT(report.disagreements, IsEmpty());
}

TEST(CheckValuesTest, LargeWorldsRunFewerTicksBeforeQueries) {
  EXPECT_EQ(ticks_before_queries(10'000), 20u);
  EXPECT_EQ(ticks_before_queries(100'000), 20u);
  EXPECT_EQ(ticks_before_queries(1'000'000), 3u);
}

}  // namespace
}  // namespace locus::bench::dynamic
