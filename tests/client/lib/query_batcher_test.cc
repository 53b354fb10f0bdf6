#include "client/lib/query_batcher.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <thread>

#include "client/lib/client.h"
#include "tests/client/lib/fake_server.h"

namespace locus::client {
namespace {

using ::testing::ElementsAre;
using testing::FakeServer;

constexpr absl::Duration kQueryDelay = absl::Hours(1);

// Returns the answer of the fake server: a ray hits the object whose id equals the x of the ray's origin, and a ball of
// radius r finds the ids 1 to r.
v1::QueryResult answer_by_values(const v1::QueryBatch& batch) {
  v1::QueryResult result;
  for (const v1::QueryBlock& block : batch.blocks()) {
    v1::BlockResult& answer = *result.add_blocks();
    for (int i = 0; i < block.rays().origins_size(); i += 3) {
      answer.add_t(2 * block.rays().origins(i));
      answer.add_ids(static_cast<uint64_t>(block.rays().origins(i)));
      answer.add_triangles(11);
    }
    for (const float radius : block.balls().radii()) {
      answer.add_counts(static_cast<uint32_t>(radius));
      for (uint64_t id = 1; id <= static_cast<uint64_t>(radius); ++id) answer.add_ids(id);
    }
  }
  return result;
}

class QueryBatcherTest : public ::testing::TestWithParam<testing::Way> {
 protected:
  void SetUp() override {
    server_.queries.stream_answer = answer_by_values;
    absl::StatusOr<std::unique_ptr<Client>> client = server_.connect(GetParam());
    ASSERT_TRUE(client.ok()) << client.status();
    client_ = *std::move(client);
  }

  QueryBatcher::HitCallback to(std::vector<absl::StatusOr<SingleHit>>& hits) {
    return [&hits](absl::StatusOr<SingleHit> hit) { hits.push_back(std::move(hit)); };
  }

  FakeServer server_;
  std::unique_ptr<Client> client_;
};

TEST_P(QueryBatcherTest, QueriesAddedTogetherAreSentInOneMessageAndGetTheirOwnAnswers) {
  std::vector<absl::StatusOr<SingleHit>> hits;
  std::vector<uint64_t> ids;
  QueryBatcher batcher(client_->query_stream("arena"), {.limits = {.max_items = 100, .max_delay = kQueryDelay}});
  for (const float x : {1.0f, 2.0f, 3.0f}) batcher.ray({.origin = {x, 0, 0}, .direction = {0, 0, 1}}, to(hits));
  batcher.ball({.center = {0, 0, 0}, .radius = 4}, [&](absl::StatusOr<std::vector<uint64_t>> found) { ids = *found; });
  batcher.flush();
  EXPECT_EQ(server_.queries.calls, 1);
  ASSERT_EQ(hits.size(), 3u);
  for (size_t i = 0; i < 3; ++i) {
    ASSERT_TRUE(hits[i].ok()) << hits[i].status();
    EXPECT_EQ(hits[i]->id, i + 1);
    EXPECT_EQ(hits[i]->t, 2 * static_cast<float>(i + 1));
    EXPECT_EQ(hits[i]->triangle, 11u);
  }
  EXPECT_THAT(ids, ElementsAre(1, 2, 3, 4));
}

TEST_P(QueryBatcherTest, AFullMessageIsSentAtOnce) {
  std::promise<uint64_t> last;
  QueryBatcher batcher(client_->query_stream("arena"), {.limits = {.max_items = 2, .max_delay = kQueryDelay}});
  batcher.ray({.origin = {1, 0, 0}, .direction = {0, 0, 1}}, [](absl::StatusOr<SingleHit>) {});
  batcher.ray({.origin = {2, 0, 0}, .direction = {0, 0, 1}},
              [&](absl::StatusOr<SingleHit> hit) { last.set_value(hit->id); });
  EXPECT_EQ(last.get_future().get(), 2u);
}

TEST_P(QueryBatcherTest, FilterFrameAndTMaxAreSentToo) {
  v1::QueryBatch seen;
  server_.queries.stream_answer = [&](const v1::QueryBatch& batch) {
    seen = batch;
    return answer_by_values(batch);
  };
  std::vector<absl::StatusOr<SingleHit>> hits;
  QueryBatcher batcher(client_->query_stream("arena"), {.limits = {}, .frame = {1e6, 0, 0}});
  batcher.ray({.origin = {1, 0, 0}, .direction = {0, 0, 1}, .t_max = 9, .filter = {.mask = 6, .ignore_group = 8}},
              to(hits));
  batcher.flush();
  ASSERT_EQ(seen.blocks_size(), 1);
  EXPECT_EQ(seen.blocks(0).frame().x(), 1e6);
  EXPECT_THAT(seen.blocks(0).rays().t_max(), ElementsAre(9));
  EXPECT_THAT(seen.blocks(0).masks(), ElementsAre(6));
  EXPECT_THAT(seen.blocks(0).ignore_groups(), ElementsAre(8));
}

TEST_P(QueryBatcherTest, WhenTheStreamEndsEveryCallbackGetsItsError) {
  std::vector<absl::StatusOr<SingleHit>> hits;
  QueryBatcher batcher(client_->query_stream("arena", {.reconnect = {.max_attempts = 1}}));
  server_.stop();
  batcher.ray({.origin = {1, 0, 0}, .direction = {0, 0, 1}}, to(hits));
  batcher.flush();
  batcher.ray({.origin = {1, 0, 0}, .direction = {0, 0, 1}}, to(hits));
  batcher.flush();
  ASSERT_EQ(hits.size(), 2u);
  EXPECT_TRUE(absl::IsUnavailable(hits[0].status())) << hits[0].status();
  EXPECT_TRUE(absl::IsUnavailable(hits[1].status())) << hits[1].status();
}

TEST_P(QueryBatcherTest, AnAnswerThatDoesNotMatchTheQueriesIsDataLoss) {
  server_.queries.stream_answer = [](const v1::QueryBatch&) { return answer_by_values({}); };
  std::vector<absl::StatusOr<SingleHit>> hits;
  QueryBatcher batcher(client_->query_stream("arena"));
  batcher.ray({.origin = {1, 0, 0}, .direction = {0, 0, 1}}, to(hits));
  batcher.flush();
  ASSERT_EQ(hits.size(), 1u);
  EXPECT_EQ(hits[0].status().code(), absl::StatusCode::kDataLoss);
}

TEST_P(QueryBatcherTest, TheDestructorWaitsForAllAnswers) {
  std::vector<absl::StatusOr<SingleHit>> hits;
  {
    QueryBatcher batcher(client_->query_stream("arena"), {.limits = {.max_items = 8, .max_delay = kQueryDelay}});
    for (int i = 0; i < 20; ++i) batcher.ray({.origin = {1, 0, 0}, .direction = {0, 0, 1}}, to(hits));
  }
  EXPECT_EQ(hits.size(), 20u);
}

TEST_P(QueryBatcherTest, ManyThreadsShareOneBatcher) {
  std::atomic<int> right = 0;
  {
    QueryBatcher batcher(client_->query_stream("arena"));
    std::vector<std::thread> threads;
    for (int thread = 0; thread < 4; ++thread)
      threads.emplace_back([&, thread] {
        for (int i = 0; i < 200; ++i) {
          const auto x = static_cast<uint64_t>(1 + 200 * thread + i);
          batcher.ray({.origin = {static_cast<float>(x), 0, 0}, .direction = {0, 0, 1}},
                      [&right, x](absl::StatusOr<SingleHit> hit) { right += hit.ok() && hit->id == x ? 1 : 0; });
        }
      });
    for (std::thread& thread : threads) thread.join();
  }
  EXPECT_EQ(right, 800);
}

INSTANTIATE_TEST_SUITE_P(Ways, QueryBatcherTest, testing::kBothWays, testing::way_name);

}  // namespace
}  // namespace locus::client
