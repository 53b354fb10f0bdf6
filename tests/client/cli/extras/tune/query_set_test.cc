#include "client/cli/extras/tune/query_set.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"
#include "client/cli/extras/tune/query_turns.h"
#include "client/lib/query_builder.h"

namespace locus::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::Pair;

v1::QueryBatch one_ball() {
  client::QueryBuilder builder;
  builder.balls().ball({0, 0, 0}, 1);
  return builder.build();
}

TEST(QuerySetTest, EveryBatchOfASmallInputIsKeptAndExplained) {
  QuerySet set;
  set.add(one_ball(), "balls.csv:1");
  client::QueryBuilder rays;
  rays.rays().ray({0, 0, 0}, {1, 0, 0}).ray({0, 0, 0}, {0, 1, 0});
  set.add(rays.build(), "rays.csv:1-2");
  EXPECT_EQ(set.added(), 3u);
  EXPECT_THAT(set.counts(), ElementsAre(Pair("balls", 1), Pair("rays", 2)));
  EXPECT_TRUE(set.batches()[0].batch.explain());
  EXPECT_EQ(set.batches()[1].place, "rays.csv:1-2");
}

TEST(QuerySetTest, BatchesOfALongInputAreEvenlySpaced) {
  QuerySet set;
  constexpr size_t kAdded = 5 * QuerySet::kMaxBatches;
  for (size_t i = 0; i < kAdded; ++i) set.add(one_ball(), absl::StrCat(i));
  EXPECT_EQ(set.added(), kAdded);
  ASSERT_LE(set.batches().size(), QuerySet::kMaxBatches);
  ASSERT_GT(set.batches().size(), QuerySet::kMaxBatches / 2);
  for (size_t i = 0; i < set.batches().size(); ++i) EXPECT_EQ(set.batches()[i].place, absl::StrCat(8 * i));
}

TEST(QuerySetTest, AShortInputAfterALongOneIsKeptWhole) {
  QuerySet set;
  for (size_t i = 0; i < 3 * QuerySet::kMaxBatches; ++i) set.add(one_ball(), "balls.csv");
  for (int i = 0; i < 3; ++i) {
    client::QueryBuilder rays;
    rays.rays().ray({0, 0, 0}, {1, 0, 0});
    set.add(rays.build(), absl::StrCat("rays.csv:", i));
  }
  EXPECT_THAT(set.counts(), ElementsAre(Pair("balls", 3 * QuerySet::kMaxBatches), Pair("rays", 3)));
  ASSERT_GT(set.batches().size(), 3u);
  for (size_t i = 0; i < 3; ++i)
    EXPECT_EQ(set.batches()[set.batches().size() - 3 + i].place, absl::StrCat("rays.csv:", i));
}

TEST(QueryTurnsTest, TheMedianIsTheMiddleValue) {
  EXPECT_EQ(median({5}), 5);
  EXPECT_EQ(median({9, 1, 2}), 2);
  EXPECT_EQ(median({4, 1, 100, 2}), 3);
}

}  // namespace
}  // namespace locus::cli
