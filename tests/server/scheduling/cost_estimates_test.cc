#include "server/scheduling/cost_estimates.h"

#include <gtest/gtest.h>

#include <memory>
#include <thread>
#include <vector>

namespace locus::server {
namespace {

// Makes a block of the given kind. The estimates depend on the lengths of the block's columns, which give the number of
// queries, not on the values in the columns.
QueryBlock block_of(decltype(QueryBlock::kind) kind, Source source = Source::kBoth) {
  QueryBlock block;
  block.kind = kind;
  block.source = source;
  return block;
}

class CostEstimatesTest : public testing::Test {
 protected:
  QueryBlock rays(size_t count, RayMode mode = RayMode::kFirst, Source source = Source::kBoth) const {
    RayColumns columns;
    columns.origins = absl::MakeConstSpan(values_).subspan(0, 3 * count);
    columns.mode = mode;
    return block_of(columns, source);
  }
  QueryBlock balls(size_t count) const {
    BallColumns columns;
    columns.centers = absl::MakeConstSpan(values_).subspan(0, 3 * count);
    return block_of(columns);
  }

  const std::vector<float> values_ = std::vector<float>(30'000);
  const std::unique_ptr<CostEstimates> costs_ = std::make_unique<CostEstimates>();
};

TEST_F(CostEstimatesTest, EveryKindHasAFirstGuess) {
  for (const QueryBlock& block : {rays(1), rays(1, RayMode::kAll), balls(1), block_of(NearestColumns()),
                                  block_of(BoxColumns()), block_of(LookupColumns())}) {
    EXPECT_GE(costs_->nanoseconds_a_query(1, block), 1);
    EXPECT_LE(costs_->nanoseconds_a_query(1, block), 100'000);
  }
}

TEST_F(CostEstimatesTest, TheFirstFinishedBlockReplacesTheGuess) {
  costs_->learn(1, rays(1000), 70'000);
  EXPECT_NEAR(costs_->nanoseconds_a_query(1, rays(5)), 70, 0.1);
}

TEST_F(CostEstimatesTest, ScenesKindsAndSourcesAreKeptApart) {
  const double guess = costs_->nanoseconds_a_query(1, rays(1));
  costs_->learn(1, rays(1000), 7'000'000);
  EXPECT_EQ(costs_->nanoseconds_a_query(2, rays(1)), guess);
  EXPECT_EQ(costs_->nanoseconds_a_query(1, rays(1, RayMode::kFirst, Source::kStatic)), guess);
  EXPECT_NE(costs_->nanoseconds_a_query(1, rays(1, RayMode::kAny)), costs_->nanoseconds_a_query(1, rays(1)));
  EXPECT_NE(costs_->nanoseconds_a_query(1, balls(1)), costs_->nanoseconds_a_query(1, rays(1)));
}

TEST_F(CostEstimatesTest, AnEstimateFollowsTheMeasuredCost) {
  costs_->learn(1, rays(1000), 100'000);
  for (int i = 0; i < 20; ++i) costs_->learn(1, rays(1000), 1'000'000);
  EXPECT_NEAR(costs_->nanoseconds_a_query(1, rays(1)), 1000, 10);
}

TEST_F(CostEstimatesTest, FewQueriesCountLessThanMany) {
  costs_->learn(1, rays(1000), 100'000);
  costs_->learn(1, rays(1), 1'000'000);
  EXPECT_LT(costs_->nanoseconds_a_query(1, rays(1)), 100 + 1'000'000 / 32);
  costs_->learn(2, rays(1000), 100'000);
  costs_->learn(2, rays(10'000), 10'000'000'000);
  EXPECT_GT(costs_->nanoseconds_a_query(2, rays(1)), 100'000);
}

TEST_F(CostEstimatesTest, TheEstimateOfABatchIsTheSumOfItsBlocks) {
  costs_->learn(1, rays(1000), 100'000);
  costs_->learn(1, balls(1000), 900'000);
  QueryBatch batch;
  batch.blocks = {rays(100), balls(10)};
  EXPECT_NEAR(static_cast<double>(costs_->nanoseconds(1, batch)), 100 * 100 + 10 * 900, 2000);
}

TEST_F(CostEstimatesTest, QueriesByListCostEveryValue) {
  const double searched = costs_->nanoseconds_a_query(1, rays(1));
  EXPECT_GE(costs_->nanoseconds_a_query(1, rays(1), 1'000'000), 1'000'000) << "the first guess";
  costs_->learn(1, rays(10), 10 * 3'000, 1'000);
  EXPECT_NEAR(costs_->nanoseconds_a_query(1, rays(1), 1'000), 3'000, 1);
  EXPECT_NEAR(costs_->nanoseconds_a_query(1, rays(1), 50'000), 150'000, 50) << "the scene has grown";
  EXPECT_EQ(costs_->nanoseconds_a_query(1, rays(1)), searched) << "searches have estimates of their own";
  QueryBatch batch;
  batch.blocks = {rays(100)};
  EXPECT_NEAR(static_cast<double>(costs_->nanoseconds(1, batch, 1'000)), 300'000, 1'000);
}

TEST_F(CostEstimatesTest, LearnedCostsAreListedByKindSourceAndList) {
  EXPECT_TRUE(costs_->learned(1, 100).empty());
  costs_->learn(1, rays(1000, RayMode::kAny, Source::kStatic), 70'000, 0, 12'000);
  costs_->learn(1, rays(1000, RayMode::kAny), 90'000, 0, 20'000);
  costs_->learn(1, rays(10, RayMode::kAny), 10 * 300, 100, 10 * 100);
  costs_->learn(1, balls(100), 50'000, 0, 700);
  costs_->learn(2, balls(100), 50'000, 0, 700);
  const std::vector<KindCost> learned = costs_->learned(1, 1'000);
  ASSERT_EQ(learned.size(), 4u);
  EXPECT_EQ(cost_kind_name(learned[0].kind), "balls");
  EXPECT_NEAR(learned[0].nanoseconds, 500, 0.1);
  EXPECT_NEAR(learned[0].work, 7, 0.01);
  EXPECT_EQ(cost_kind_name(learned[1].kind), "rays_any");
  EXPECT_FALSE(learned[1].by_list);
  EXPECT_TRUE(learned[2].by_list);
  EXPECT_NEAR(learned[2].nanoseconds, 3'000, 1) << "the scene has ten times as many values now";
  EXPECT_NEAR(learned[2].work, 1'000, 1);
  EXPECT_EQ(learned[3].source, Source::kStatic);
  EXPECT_NEAR(learned[3].work, 12, 0.01);
  costs_->learn(1, balls(2048), 2048 * 500, 0, 2048 * 9);
  EXPECT_NEAR(costs_->learned(1, 1'000)[0].work, 8, 0.01) << "the mean moves to the new measurement";
}

TEST_F(CostEstimatesTest, PairsByListTestEachValueForEachValue) {
  const QueryBlock pairs = block_of(PairColumns());
  costs_->learn(1, pairs, 2'000'000, 1'000);
  EXPECT_NEAR(costs_->nanoseconds_a_query(1, pairs, 1'000), 2'000'000, 1'000);
  EXPECT_NEAR(costs_->nanoseconds_a_query(1, pairs, 2'000), 8'000'000, 4'000);
}

TEST_F(CostEstimatesTest, ABlockWithoutQueriesChangesNoEstimate) {
  const double before = costs_->nanoseconds_a_query(1, rays(1));
  costs_->learn(1, rays(0), 1'000'000);
  EXPECT_EQ(costs_->nanoseconds_a_query(1, rays(1)), before);
}

TEST_F(CostEstimatesTest, MoreScenesThanEntriesGiveUsableEstimates) {
  for (uint64_t scene = 0; scene < 3 * CostEstimates::kEntries; ++scene) costs_->learn(scene, rays(1000), 50'000);
  const uint64_t last = 3 * CostEstimates::kEntries - 1;
  EXPECT_NEAR(costs_->nanoseconds_a_query(last, rays(1)), 50, 0.1) << "the latest is known";
}

TEST_F(CostEstimatesTest, ConcurrentLearningLeavesAValueOfOneThread) {
  std::vector<std::thread> threads;
  for (uint64_t thread = 1; thread <= 4; ++thread)
    threads.emplace_back([this, thread] {
      for (int i = 0; i < 2'000; ++i) {
        costs_->learn(1, rays(1000), thread * 100'000);
        const double seen = costs_->nanoseconds_a_query(1, rays(1));
        EXPECT_GE(seen, 99.9);
        EXPECT_LE(seen, 400.1);
      }
    });
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace locus::server
