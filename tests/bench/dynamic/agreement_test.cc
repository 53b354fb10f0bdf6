#include "tests/bench/dynamic/agreement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/bench/dynamic/ours.h"

namespace locus::bench::dynamic {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class DynamicAgreementTest : public testing::Test {
 protected:
  DynamicAgreementTest() : queries(queries_of(world, 1000)) {
    Ours contender;
    contender.load(world.objects());
    contender.balls(queries.centers, balls);
    contender.rays(queries.rays, rays);
    contender.nearest(queries.centers, nearest);
  }

  void compare_balls(const Answers& ours, const Answers& theirs) {
    compare("ball", Task::kBall, world, queries, ours, "peer", theirs, report);
  }

  // Returns the answers without the first id of each of the first `wrong_queries` queries.
  Answers forgetful(size_t wrong_queries) const {
    Answers answers = balls;
    size_t begin = 0;
    for (size_t i = 0; i < wrong_queries; ++i) {
      answers.ids.erase(answers.ids.begin() + static_cast<ptrdiff_t>(begin));
      begin += --answers.counts[i];
    }
    return answers;
  }

  const World world{Kind::kUniform, 1000, 100};
  const Queries queries;
  Answers balls, rays, nearest;
  Report report;
};

TEST_F(DynamicAgreementTest, EqualIdsInAnyOrderAgree) {
  Answers theirs = balls;
  std::reverse(theirs.ids.begin(), theirs.ids.begin() + theirs.counts[0]);
  compare_balls(balls, theirs);
  EXPECT_THAT(report.notes, IsEmpty());
  EXPECT_THAT(report.disagreements, IsEmpty());
}

TEST_F(DynamicAgreementTest, FewWrongAnswersOfAPeerAreNoted) {
  compare_balls(balls, forgetful(2));
  EXPECT_THAT(report.notes, ElementsAre(HasSubstr("peer is wrong in 2 of 1000 queries, first in query 0")));
  EXPECT_THAT(report.disagreements, IsEmpty());
}

TEST_F(DynamicAgreementTest, ManyWrongAnswersOfAPeerAreADisagreement) {
  compare_balls(balls, forgetful(3));
  EXPECT_THAT(report.disagreements, ElementsAre(HasSubstr("peer is wrong in more than 2 of 1000 queries")));
}

TEST_F(DynamicAgreementTest, OneWrongAnswerOfOursIsADisagreement) {
  compare_balls(forgetful(1), balls);
  EXPECT_THAT(report.disagreements, ElementsAre(HasSubstr("query 0: ours is wrong")));
}

TEST_F(DynamicAgreementTest, ARayWithAnotherDistanceDiffers) {
  Answers theirs = rays;
  ASSERT_FALSE(theirs.distances.empty());
  theirs.distances[0] += 2 * kSameDistance;
  compare("ray", Task::kRay, world, queries, rays, "peer", theirs, report);
  EXPECT_THAT(report.notes, ElementsAre(HasSubstr("peer is wrong in 1 of 1000")));
}

TEST_F(DynamicAgreementTest, AnotherNearestObjectAtTheSameDistanceAgrees) {
  Answers theirs = nearest;
  theirs.ids[0] = 1;
  compare("nearest", Task::kNearest, world, queries, nearest, "peer", theirs, report);
  EXPECT_THAT(report.notes, IsEmpty());
  EXPECT_THAT(report.disagreements, IsEmpty());
}

TEST_F(DynamicAgreementTest, AFartherNearestObjectDiffers) {
  Answers theirs = nearest;
  theirs.distances[0] += 2 * kSameNearDistance;
  theirs.ids[0] = 1;
  compare("nearest", Task::kNearest, world, queries, nearest, "peer", theirs, report);
  EXPECT_THAT(report.notes, ElementsAre(HasSubstr("peer is wrong in 1 of 1000")));
}

TEST_F(DynamicAgreementTest, AWrongTieOfOursIsADisagreement) {
  Answers ours = nearest;
  ours.ids[0] = 1;
  compare("nearest", Task::kNearest, world, queries, ours, "peer", nearest, report);
  EXPECT_THAT(report.disagreements, ElementsAre(HasSubstr("query 0: ours is wrong")));
}

}  // namespace
}  // namespace locus::bench::dynamic
