#include "client/cli/extras/verify/random_queries.h"

#include <gtest/gtest.h>

#include <set>

#include "client/cli/extras/verify/answer_comparison.h"

namespace locus::cli {
namespace {

v1::Scene scene_of(uint64_t objects, uint64_t oldest_tick = 5) {
  v1::Scene scene;
  scene.set_objects(objects);
  scene.set_oldest_tick(oldest_tick);
  scene.set_tick(5);
  scene.mutable_min()->set_x(1e6);
  scene.mutable_max()->set_x(1e6 + 100);
  scene.mutable_max()->set_y(10);
  return scene;
}

TEST(RandomQueriesTest, ABatchHasABlockOfEveryKind) {
  RandomQueries random(scene_of(10), 1);
  std::set<int> kinds;
  const v1::QueryBatch batch = random.next(3);
  for (const v1::QueryBlock& block : batch.blocks()) {
    kinds.insert(block.kind_case());
    EXPECT_EQ(query_count(block), block.has_pairs() ? 1u : 3u) << block.kind_case();
  }
  const auto* const all = v1::QueryBlock::descriptor()->FindOneofByName("kind");
  EXPECT_EQ(kinds.size(), static_cast<size_t>(all->field_count()));
}

TEST(RandomQueriesTest, PairsAreLeftOutAmongManyObjects) {
  RandomQueries random(scene_of(RandomQueries::kMaxPairedObjects + 1), 1);
  EXPECT_FALSE(random.asks_pairs());
  const v1::QueryBatch batch = random.next(1);
  for (const v1::QueryBlock& block : batch.blocks()) EXPECT_FALSE(block.has_pairs());
}

TEST(RandomQueriesTest, EqualSeedsGiveEqualBatches) {
  RandomQueries a(scene_of(10), 7), b(scene_of(10), 7), c(scene_of(10), 8);
  for (int i = 0; i < 5; ++i) {
    const std::string batch = a.next(4).SerializeAsString();
    EXPECT_EQ(batch, b.next(4).SerializeAsString());
    EXPECT_NE(batch, c.next(4).SerializeAsString());
  }
}

TEST(RandomQueriesTest, QueriesAskAboutThePastOnlyIfThereIsOne) {
  RandomQueries without(scene_of(10), 1), with(scene_of(10, 2), 1);
  bool asked = false;
  for (int i = 0; i < 20; ++i) {
    const v1::QueryBatch now = without.next(1), past = with.next(1);
    for (const v1::QueryBlock& block : now.blocks()) EXPECT_TRUE(block.as_of_ticks().empty());
    for (const v1::QueryBlock& block : past.blocks())
      for (const uint64_t tick : block.as_of_ticks()) {
        asked = true;
        EXPECT_GE(tick, 2u);
        EXPECT_LT(tick, 5u);
      }
  }
  EXPECT_TRUE(asked);
}

TEST(RandomQueriesTest, IdsOfAnswersAreLookedUp) {
  RandomQueries random(scene_of(10), 1);
  v1::QueryResult result;
  result.add_blocks()->add_ids(uint64_t{1} << 40);
  random.learn_ids(result);
  bool found = false;
  const v1::QueryBatch batch = random.next(100);
  for (const v1::QueryBlock& block : batch.blocks())
    for (const uint64_t id : block.lookup().ids()) found = found || id == uint64_t{1} << 40;
  EXPECT_TRUE(found);
}

}  // namespace
}  // namespace locus::cli
