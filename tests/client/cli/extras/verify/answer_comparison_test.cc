#include "client/cli/extras/verify/answer_comparison.h"

#include <gtest/gtest.h>

#include "client/lib/query_builder.h"

namespace locus::cli {
namespace {

v1::QueryBatch rays_and_balls() {
  client::QueryBuilder builder;
  builder.rays().ray({0, 0, 0}, {1, 0, 0}).ray({0, 1, 0}, {1, 0, 0}).ray({0, 2, 0}, {1, 0, 0});
  builder.balls().ball({0, 0, 0}, 1).ball({1, 0, 0}, 1);
  return builder.build();
}

// Answers the rays with t = 1, 2, 3 and the balls with the ids 5, 6 and 7.
v1::QueryResult answer() {
  v1::QueryResult result;
  v1::BlockResult& rays = *result.add_blocks();
  for (const uint32_t i : {1u, 2u, 3u}) {
    rays.add_t(static_cast<float>(i));
    rays.add_ids(i);
  }
  v1::BlockResult& balls = *result.add_blocks();
  balls.add_counts(2);
  balls.add_counts(1);
  for (const uint64_t id : {5u, 6u, 7u}) balls.add_ids(id);
  return result;
}

void expect_difference(const v1::QueryResult& other, size_t block, std::optional<size_t> query,
                       const std::string& column) {
  const std::optional<AnswerDifference> found = first_difference(rays_and_balls(), answer(), other);
  ASSERT_TRUE(found.has_value()) << column;
  EXPECT_EQ(found->block, block);
  EXPECT_EQ(found->query, query);
  EXPECT_EQ(found->column, column);
}

TEST(AnswerComparisonTest, EqualAnswersHaveNoDifference) {
  EXPECT_EQ(first_difference(rays_and_balls(), answer(), answer()), std::nullopt);
}

TEST(AnswerComparisonTest, TheFirstQueryWhoseRowsDifferIsNamed) {
  v1::QueryResult other = answer();
  other.mutable_blocks(0)->set_ids(2, 9);
  other.mutable_blocks(1)->set_ids(0, 9);
  expect_difference(other, 0, 2, "ids");
  other.mutable_blocks(0)->set_t(1, 9);
  expect_difference(other, 0, 1, "t");
}

TEST(AnswerComparisonTest, RowsBelongToTheQueriesThatTheCountsSay) {
  v1::QueryResult other = answer();
  other.mutable_blocks(1)->set_ids(1, 9);
  expect_difference(other, 1, 0, "ids");
  other = answer();
  other.mutable_blocks(1)->set_ids(2, 9);
  expect_difference(other, 1, 1, "ids");
}

TEST(AnswerComparisonTest, AMissingRowIsADifferenceOfItsQuery) {
  v1::QueryResult other = answer();
  other.mutable_blocks(1)->set_counts(1, 0);
  other.mutable_blocks(1)->mutable_ids()->RemoveLast();
  expect_difference(other, 1, 1, "counts");
}

TEST(AnswerComparisonTest, AnOrderOfRowsAndAListOfQueriesAreCompared) {
  v1::QueryResult other = answer();
  other.mutable_blocks(1)->add_truncated(1);
  expect_difference(other, 1, std::nullopt, "truncated");
  other = answer();
  other.mutable_blocks()->RemoveLast();
  expect_difference(other, 1, std::nullopt, "blocks");
}

TEST(AnswerComparisonTest, QueriesOfEveryKindAreCounted) {
  client::QueryBuilder builder;
  builder.frustums().planes(std::vector<float>(4 * 6 * 2, 1));
  builder.frustums().view_projections(std::vector<float>(32, 1));
  builder.sight().viewers(std::vector<float>(12), 2).targets(std::vector<float>(9));
  builder.pairs().max_distance(1);
  builder.lookup().ids({1, 2, 3});
  builder.contains().points(std::vector<float>(6));
  const v1::QueryBatch batch = builder.build();
  const std::vector<size_t> counts = {2, 2, 2, 1, 3, 2};
  for (int i = 0; i < batch.blocks_size(); ++i) EXPECT_EQ(query_count(batch.blocks(i)), counts[static_cast<size_t>(i)]);
}

}  // namespace
}  // namespace locus::cli
