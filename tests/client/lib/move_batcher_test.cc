#include "client/lib/move_batcher.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "client/lib/client.h"
#include "tests/client/lib/fake_server.h"

namespace locus::client {
namespace {

using ::testing::ElementsAre;
using testing::FakeServer;

constexpr absl::Duration kMoveDelay = absl::Hours(1);

class MoveBatcherTest : public ::testing::TestWithParam<testing::Way> {
 protected:
  void SetUp() override {
    absl::StatusOr<std::unique_ptr<Client>> client = server_.connect(GetParam());
    ASSERT_TRUE(client.ok()) << client.status();
    client_ = *std::move(client);
  }

  FakeServer server_;
  std::unique_ptr<Client> client_;
};

TEST_P(MoveBatcherTest, MovesAddedTogetherAreOneMessageInOrder) {
  MoveBatcher moves(client_->update_stream("arena"), {.max_items = 100, .max_delay = kMoveDelay});
  for (const uint64_t id : {7u, 8u, 7u}) moves.move(id, Float3{static_cast<float>(id), 0, 0});
  ASSERT_TRUE(moves.flush().ok());
  EXPECT_EQ(server_.updates.applied().size(), 1u);
  ASSERT_EQ(server_.updates.last_batch.moves_size(), 1);
  EXPECT_THAT(server_.updates.last_batch.moves(0).ids(), ElementsAre(7, 8, 7));
  EXPECT_THAT(server_.updates.last_batch.moves(0).positions(), ElementsAre(7, 0, 0, 8, 0, 0, 7, 0, 0));
}

TEST_P(MoveBatcherTest, AFullMessageIsSentAndTheNextOneStarted) {
  {
    MoveBatcher moves(client_->update_stream("arena"), {.max_items = 10, .max_delay = kMoveDelay});
    for (uint64_t id = 1; id <= 25; ++id) moves.move(id, Float3{0, 0, 0});
  }
  EXPECT_EQ(server_.updates.applied().size(), 3u);
  EXPECT_EQ(server_.updates.last_batch.moves(0).ids_size(), 5);
}

TEST_P(MoveBatcherTest, EachMessageIsAcked) {
  std::vector<uint64_t> revisions;
  MoveBatcher moves(client_->update_stream("arena"), {.max_items = 1},
                    [&](const absl::StatusOr<v1::UpdateAck>& ack) { revisions.push_back(ack->revision()); });
  for (uint64_t id = 1; id <= 3; ++id) moves.move(id, Float3{0, 0, 0});
  ASSERT_TRUE(moves.flush().ok());
  EXPECT_THAT(revisions, ElementsAre(1, 2, 3));
}

TEST_P(MoveBatcherTest, EachMessageIsAppliedOnceDespiteABrokenConnection) {
  server_.updates.breaks = {.after_messages = 2, .times = 4, .apply_last = true};
  const RetryPolicy quick = {.max_attempts = 20, .first_backoff = absl::Milliseconds(1)};
  MoveBatcher moves(client_->update_stream("arena", {.reconnect = quick}), {.max_items = 1});
  for (uint64_t id = 1; id <= 12; ++id) moves.move(id, Float3{0, 0, 0});
  ASSERT_TRUE(moves.flush().ok());
  EXPECT_EQ(server_.updates.applied().size(), 12u);
}

TEST_P(MoveBatcherTest, FlushAndEachAckReportTheEndOfTheStream) {
  std::vector<absl::StatusCode> codes;
  MoveBatcher moves(client_->update_stream("arena", {.reconnect = {.max_attempts = 1}}), {},
                    [&](const absl::StatusOr<v1::UpdateAck>& ack) { codes.push_back(ack.status().code()); });
  server_.stop();
  moves.move(1, Float3{0, 0, 0});
  EXPECT_TRUE(absl::IsUnavailable(moves.flush()));
  moves.move(2, Float3{0, 0, 0});
  EXPECT_TRUE(absl::IsUnavailable(moves.flush()));
  EXPECT_THAT(codes, ElementsAre(absl::StatusCode::kUnavailable, absl::StatusCode::kUnavailable));
}

INSTANTIATE_TEST_SUITE_P(Ways, MoveBatcherTest, testing::kBothWays, testing::way_name);

}  // namespace
}  // namespace locus::client
