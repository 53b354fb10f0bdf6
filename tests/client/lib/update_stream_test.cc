#include "client/lib/update_stream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>
#include <thread>

#include "absl/time/clock.h"
#include "client/lib/client.h"
#include "client/lib/status.h"
#include "tests/client/lib/fake_server.h"

namespace locus::client {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using testing::FakeServer;
using ::testing::IsEmpty;

constexpr RetryPolicy kQuickReconnect = {
    .max_attempts = 20, .first_backoff = absl::Milliseconds(1), .max_backoff = absl::Milliseconds(20)};

v1::UpdateBatch batch_of_tick(uint64_t tick) {
  v1::UpdateBatch batch;
  batch.set_tick(tick);
  return batch;
}

// Returns `messages` batches, of which the last has the tick.
std::vector<v1::UpdateBatch> group_of_tick(uint64_t tick, size_t messages) {
  std::vector<v1::UpdateBatch> batches(messages);
  batches.back() = batch_of_tick(tick);
  return batches;
}

std::vector<uint64_t> one_to(uint64_t last) {
  std::vector<uint64_t> ticks(last);
  std::iota(ticks.begin(), ticks.end(), 1);
  return ticks;
}

// Recorder of the ticks and status codes of batches, in the order in which the batches' callbacks were called.
struct Outcomes {
  std::mutex mutex;
  std::vector<uint64_t> ticks;
  std::vector<absl::StatusCode> codes;

  UpdateStream::AckCallback of(uint64_t tick) {
    return [this, tick](absl::StatusOr<v1::UpdateAck> ack) {
      std::lock_guard lock(mutex);
      ticks.push_back(tick);
      codes.push_back(ack.status().code());
    };
  }
};

class UpdateStreamTest : public ::testing::TestWithParam<testing::Way> {
 protected:
  void SetUp() override {
    absl::StatusOr<std::unique_ptr<Client>> client = server_.connect(GetParam());
    ASSERT_TRUE(client.ok()) << client.status();
    client_ = *std::move(client);
  }

  std::unique_ptr<UpdateStream> open(int max_in_flight = 8) {
    return client_->update_stream("arena", {.max_in_flight = max_in_flight, .reconnect = kQuickReconnect});
  }

  void send_ticks(UpdateStream& stream, uint64_t last, Outcomes& outcomes) {
    for (uint64_t tick = 1; tick <= last; ++tick) {
      ASSERT_TRUE(stream.send(batch_of_tick(tick), outcomes.of(tick)).ok());
    }
  }

  FakeServer server_;
  std::unique_ptr<Client> client_;
};

// Tests that restart the server, which a client in the same process cannot reach again.
class UpdateStreamRestartTest : public UpdateStreamTest {};

TEST_P(UpdateStreamTest, BatchesAreAppliedAndAckedInOrder) {
  const auto stream = open();
  Outcomes outcomes;
  send_ticks(*stream, 100, outcomes);
  ASSERT_TRUE(stream->flush().ok());
  EXPECT_EQ(server_.updates.applied(), one_to(100));
  EXPECT_EQ(outcomes.ticks, one_to(100));
  EXPECT_THAT(outcomes.codes, Each(absl::StatusCode::kOk));
  EXPECT_EQ(stream->last_ack(), (Revision{9, 100}));
  EXPECT_EQ(server_.updates.streams, 1);
  EXPECT_THAT(server_.updates.scenes, ElementsAre("arena")) << "x-scene";
}

TEST_P(UpdateStreamTest, AfterABreakBatchesAppliedWithoutAckAreNotAppliedAgain) {
  server_.updates.breaks = {.after_messages = 3, .times = 5, .apply_last = true};
  const auto stream = open();
  Outcomes outcomes;
  send_ticks(*stream, 50, outcomes);
  ASSERT_TRUE(stream->flush().ok());
  EXPECT_EQ(server_.updates.applied(), one_to(50));
  EXPECT_EQ(outcomes.ticks, one_to(50));
  EXPECT_THAT(outcomes.codes, Each(absl::StatusCode::kOk));
  EXPECT_EQ(server_.updates.streams, 6);
  EXPECT_GE(server_.updates.duplicates, 1);
}

TEST_P(UpdateStreamTest, AfterABreakLostBatchesAreSentAgain) {
  server_.updates.breaks = {.after_messages = 2, .times = 7, .apply_last = false};
  const auto stream = open();
  Outcomes outcomes;
  send_ticks(*stream, 50, outcomes);
  ASSERT_TRUE(stream->flush().ok());
  EXPECT_EQ(server_.updates.applied(), one_to(50));
  EXPECT_EQ(outcomes.ticks, one_to(50));
}

TEST_P(UpdateStreamRestartTest, ARestartedServerWithItsStateGetsTheRemainingBatches) {
  const auto stream = open();
  Outcomes outcomes;
  send_ticks(*stream, 10, outcomes);
  server_.stop();
  std::thread sender([&] {
    for (uint64_t tick = 11; tick <= 40; ++tick) {
      EXPECT_TRUE(stream->send(batch_of_tick(tick), outcomes.of(tick)).ok());
    }
  });
  server_.restart();
  sender.join();
  ASSERT_TRUE(stream->flush().ok());
  EXPECT_EQ(server_.updates.applied(), one_to(40));
  EXPECT_EQ(outcomes.ticks, one_to(40));
}

TEST_P(UpdateStreamTest, ARefusedBatchDoesNotAffectOthersAndTheRestIsRenumbered) {
  server_.updates.refused_ticks = {1, 5, 6, 20};
  const auto stream = open();
  Outcomes outcomes;
  send_ticks(*stream, 20, outcomes);
  ASSERT_TRUE(stream->flush().ok());
  EXPECT_EQ(outcomes.ticks, one_to(20));
  for (size_t i = 0; i < outcomes.codes.size(); ++i) {
    const bool refused = server_.updates.refused_ticks.count(outcomes.ticks[i]) > 0;
    EXPECT_EQ(outcomes.codes[i], refused ? absl::StatusCode::kInvalidArgument : absl::StatusCode::kOk) << i;
  }
  std::vector<uint64_t> expected = one_to(20);
  std::erase_if(expected, [&](uint64_t tick) { return server_.updates.refused_ticks.count(tick) > 0; });
  EXPECT_EQ(server_.updates.applied(), expected);
  EXPECT_EQ(server_.updates.streams, 1) << "a refusal does not end the stream";
}

TEST_P(UpdateStreamTest, EachBatchIsAppliedOnceDespiteRefusalsAndBreaks) {
  server_.updates.refused_ticks = {3, 17, 18, 33};
  server_.updates.breaks = {.after_messages = 5, .times = 12, .apply_last = true};
  const auto stream = open();
  Outcomes outcomes;
  send_ticks(*stream, 60, outcomes);
  ASSERT_TRUE(stream->flush().ok());
  std::vector<uint64_t> expected = one_to(60);
  std::erase_if(expected, [&](uint64_t tick) { return server_.updates.refused_ticks.count(tick) > 0; });
  EXPECT_EQ(server_.updates.applied(), expected);
  EXPECT_EQ(outcomes.ticks, one_to(60));
}

// A batch that was applied, and is refused when it is sent again, keeps its number. Otherwise the next batch would get
// the number, and the server would take it for a repetition.
TEST_P(UpdateStreamTest, ARepeatedBatchThatIsRefusedFreesItsNumberOnlyIfItWasNotApplied) {
  for (const bool applied : {true, false}) {
    const uint64_t first = applied ? 1 : 11;
    server_.updates.breaks = {.after_messages = 2, .times = 1, .apply_last = applied};
    server_.updates.refused_repeats = {2, 12};
    const auto stream = open();
    std::vector<std::future<absl::StatusOr<v1::UpdateAck>>> acks;
    for (uint64_t i = 0; i < 6; ++i) acks.push_back(stream->send(batch_of_tick(first + i)));
    EXPECT_TRUE(stream->close().ok());
    for (uint64_t i = 0; i < 6; ++i) {
      const absl::StatusOr<v1::UpdateAck> ack = acks[i].get();
      EXPECT_EQ(ack.ok(), i != 1) << i << ": " << ack.status();
      if (ack.ok()) {
        EXPECT_FALSE(ack->duplicate()) << i;
      } else {
        EXPECT_FALSE(refused_by_server(ack.status())) << ack.status();
      }
    }
  }
  EXPECT_THAT(server_.updates.applied(), ElementsAre(1, 2, 3, 4, 5, 6, 11, 13, 14, 15, 16));
}

TEST_P(UpdateStreamTest, AServerThatForgotTheWriterEndsTheStreamInsteadOfLosingBatches) {
  const auto stream = open();
  ASSERT_TRUE(stream->send(batch_of_tick(1)).get().ok());
  server_.updates.forget_writers();
  const absl::Status status = stream->send(batch_of_tick(2)).get().status();
  EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
  ASSERT_TRUE(error_of(status).has_value());
  EXPECT_EQ(error_of(status)->reason(), v1::REASON_BATCH_GAP);
  EXPECT_TRUE(absl::IsFailedPrecondition(stream->flush()));
  EXPECT_TRUE(absl::IsFailedPrecondition(stream->send(batch_of_tick(3)).get().status()));
  EXPECT_THAT(server_.updates.applied(), ElementsAre(1));
}

TEST_P(UpdateStreamTest, WhenReconnectingFailsEveryUnansweredBatchGetsTheError) {
  const auto stream =
      client_->update_stream("arena", {.reconnect = {.max_attempts = 2, .first_backoff = absl::Milliseconds(1)}});
  server_.stop();
  std::future<absl::StatusOr<v1::UpdateAck>> first = stream->send(batch_of_tick(1));
  EXPECT_TRUE(absl::IsUnavailable(first.get().status()));
  EXPECT_TRUE(absl::IsUnavailable(stream->flush()));
  EXPECT_TRUE(absl::IsUnavailable(stream->send(batch_of_tick(2)).get().status()));
}

TEST_P(UpdateStreamTest, ARefusedStreamIsNotRetried) {
  server_.updates.breaks = {
      .after_messages = 1, .times = 1, .status = {grpc::StatusCode::PERMISSION_DENIED, "planned"}};
  const auto stream = open();
  EXPECT_TRUE(absl::IsPermissionDenied(stream->send(batch_of_tick(1)).get().status()));
  EXPECT_TRUE(absl::IsPermissionDenied(stream->close()));
  EXPECT_EQ(server_.updates.streams, 1);
}

TEST_P(UpdateStreamTest, AtMostMaxInFlightBatchesAreUnanswered) {
  const auto stream = open(/*max_in_flight=*/1);
  Outcomes outcomes;
  send_ticks(*stream, 30, outcomes);
  ASSERT_TRUE(stream->close().ok());
  EXPECT_EQ(outcomes.ticks, one_to(30));
  EXPECT_TRUE(absl::IsFailedPrecondition(stream->send(batch_of_tick(31)).get().status())) << "closed";
}

TEST_P(UpdateStreamTest, ClosingAnUnusedStreamOpensNoCall) {
  const auto stream = open();
  EXPECT_TRUE(stream->close().ok());
  EXPECT_EQ(server_.updates.streams, 0);
  EXPECT_FALSE(stream->last_ack().has_value());
}

TEST_P(UpdateStreamTest, CancellingTheStreamFailsEveryUnansweredBatch) {
  server_.updates.breaks = {.after_messages = 1, .times = 1'000'000};
  Outcomes outcomes;
  {
    const auto stream = client_->update_stream(
        "arena", {.reconnect = {.max_attempts = 1'000'000, .first_backoff = absl::Milliseconds(1)}});
    send_ticks(*stream, 8, outcomes);
  }
  EXPECT_EQ(outcomes.ticks, one_to(8));
  EXPECT_THAT(outcomes.codes, Each(absl::StatusCode::kCancelled));
}

TEST_P(UpdateStreamTest, SeveralThreadsShareOneStream) {
  const auto stream = open();
  Outcomes outcomes;
  std::vector<std::thread> threads;
  for (uint64_t first : {1, 101, 201, 301}) {
    threads.emplace_back([&, first] {
      for (uint64_t tick = first; tick < first + 50; ++tick) {
        EXPECT_TRUE(stream->send(batch_of_tick(tick), outcomes.of(tick)).ok());
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  ASSERT_TRUE(stream->flush().ok());
  EXPECT_EQ(server_.updates.applied().size(), 200u);
  EXPECT_EQ(outcomes.ticks, server_.updates.applied());
}

TEST_P(UpdateStreamTest, BatchesSentTogetherAreAppliedAsOneWithOneAck) {
  const auto stream = open(/*max_in_flight=*/2);
  Outcomes outcomes;
  for (uint64_t tick = 1; tick <= 20; ++tick) {
    ASSERT_TRUE(stream->send_together(group_of_tick(tick, 1 + tick % 4), outcomes.of(tick)).ok());
  }
  ASSERT_TRUE(stream->flush().ok());
  EXPECT_EQ(server_.updates.applied(), one_to(20));
  for (uint64_t tick = 1; tick <= 20; ++tick) EXPECT_EQ(server_.updates.applied_messages()[tick - 1], 1 + tick % 4);
  EXPECT_EQ(outcomes.ticks, one_to(20));
  EXPECT_THAT(outcomes.codes, Each(absl::StatusCode::kOk));
  EXPECT_EQ(server_.updates.gaps, 0);
  EXPECT_TRUE(absl::IsInvalidArgument(stream->send_together({}).get().status()));
}

TEST_P(UpdateStreamTest, BatchesSentTogetherAreAllSentAgainAfterABreak) {
  // 25 batches of 3 messages each. Streams break at the first, second or third message of a batch. Half of the breaks
  // lose the message, the others lose its answer.
  size_t batches = 0;
  for (const int after_messages : {7, 8, 9}) {
    for (const bool apply_last : {false, true}) {
      const auto stream = open();
      server_.updates.breaks = {.after_messages = after_messages, .times = 5, .apply_last = apply_last};
      Outcomes outcomes;
      for (uint64_t tick = 1; tick <= 25; ++tick) {
        ASSERT_TRUE(stream->send_together(group_of_tick(tick, 3), outcomes.of(tick)).ok());
      }
      ASSERT_TRUE(stream->flush().ok());
      EXPECT_EQ(outcomes.ticks, one_to(25));
      EXPECT_THAT(outcomes.codes, Each(absl::StatusCode::kOk));
      batches += 25;
      EXPECT_EQ(server_.updates.applied().size(), batches) << after_messages << apply_last;
    }
  }
  EXPECT_THAT(server_.updates.applied_messages(), Each(3u));
}

TEST_P(UpdateStreamTest, ARefusedMessageRefusesAllThatWereSentTogetherAndNothingElse) {
  const auto stream = open();
  std::vector<std::future<absl::StatusOr<v1::UpdateAck>>> acks;
  for (uint64_t tick = 1; tick <= 6; ++tick) {
    std::vector<v1::UpdateBatch> batches = group_of_tick(tick, 3);
    if (tick == 3) batches[1].set_tick(3);
    acks.push_back(stream->send_together(std::move(batches)));
  }
  ASSERT_TRUE(stream->flush().ok());
  for (uint64_t tick = 1; tick <= 6; ++tick) {
    const absl::Status status = acks[tick - 1].get().status();
    if (tick != 3) {
      EXPECT_TRUE(status.ok()) << tick << ": " << status;
    } else {
      EXPECT_EQ(error_of(status)->reason(), v1::REASON_OUT_OF_RANGE) << "the error of the first refused message";
    }
  }
  EXPECT_THAT(server_.updates.applied(), ElementsAre(1, 2, 4, 5, 6));
  EXPECT_THAT(server_.updates.applied_messages(), Each(3u));
}

TEST_P(UpdateStreamTest, RenumberedMessagesNeverJoinThoseThatTheServerHolds) {
  server_.updates.refused_ticks = {1, 2, 9, 15, 16};
  const auto stream = open(/*max_in_flight=*/4);
  Outcomes outcomes;
  for (uint64_t tick = 1; tick <= 40; ++tick) {
    ASSERT_TRUE(stream->send_together(group_of_tick(tick, 1 + tick % 6), outcomes.of(tick)).ok());
  }
  ASSERT_TRUE(stream->flush().ok());
  std::vector<uint64_t> expected = one_to(40);
  std::erase_if(expected, [&](uint64_t tick) { return server_.updates.refused_ticks.count(tick) > 0; });
  EXPECT_EQ(server_.updates.applied(), expected);
  for (size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(server_.updates.applied_messages()[i], 1 + expected[i] % 6) << expected[i];
  }
  EXPECT_EQ(outcomes.ticks, one_to(40));
}

TEST_P(UpdateStreamTest, AServerThatAppliesMessagesOneByOneEndsTheStream) {
  server_.updates.forgets_continues = true;
  const auto stream = open();
  const absl::Status status = stream->send_together(group_of_tick(1, 2)).get().status();
  EXPECT_TRUE(absl::IsUnimplemented(status)) << status;
  EXPECT_TRUE(absl::IsUnimplemented(stream->flush()));
}

TEST_P(UpdateStreamTest, EveryBatchCarriesTheLease) {
  const auto stream = client_->update_stream("arena", {.lease = absl::Microseconds(59'999'001)});
  v1::UpdateBatch own = batch_of_tick(2);
  own.set_lease_ms(5);
  ASSERT_TRUE(stream->send(batch_of_tick(1)).get().ok());
  ASSERT_TRUE(stream->send(own).get().ok());
  ASSERT_TRUE(stream->send_together(group_of_tick(3, 2)).get().ok());
  EXPECT_THAT(server_.updates.leases(), ElementsAre(60'000, 5, 60'000));
}

TEST_P(UpdateStreamTest, ASilentStreamRenewsItsLeaseAlsoOnANewConnection) {
  const auto stream = client_->update_stream("arena", {.reconnect = kQuickReconnect, .lease = absl::Milliseconds(30)});
  EXPECT_THAT(server_.updates.applied(), IsEmpty()) << "the lease begins with the first batch";
  ASSERT_TRUE(stream->send(batch_of_tick(1)).get().ok());
  const auto wait_for = [&](size_t batches) {
    const absl::Time end = absl::Now() + absl::Seconds(30);
    while (server_.updates.applied().size() < batches && absl::Now() < end) absl::SleepFor(absl::Milliseconds(1));
    return server_.updates.applied().size() >= batches;
  };
  EXPECT_TRUE(wait_for(4));
  server_.updates.break_next_message();
  EXPECT_TRUE(wait_for(10));
  EXPECT_THAT(server_.updates.leases(), Each(30u));
  EXPECT_EQ(server_.updates.last_batch.ByteSizeLong(), [&] {
    v1::UpdateBatch numbers;
    numbers.set_writer(stream->writer());
    numbers.set_batch(1);
    numbers.set_lease_ms(30);
    return numbers.ByteSizeLong();
  }()) << "a renewal changes nothing";
  ASSERT_TRUE(stream->close().ok());
}

INSTANTIATE_TEST_SUITE_P(Ways, UpdateStreamRestartTest, ::testing::Values(testing::Way::kLoopback), testing::way_name);
INSTANTIATE_TEST_SUITE_P(Ways, UpdateStreamTest, testing::kBothWays, testing::way_name);

}  // namespace
}  // namespace locus::client
