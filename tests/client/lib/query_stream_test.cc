#include "client/lib/query_stream.h"

#include <gtest/gtest.h>

#include "client/lib/client.h"
#include "client/lib/status.h"
#include "tests/client/lib/fake_server.h"

namespace locus::client {
namespace {

using testing::FakeQueries;
using testing::FakeServer;

class QueryStreamTest : public ::testing::TestWithParam<testing::Way> {
 protected:
  void SetUp() override {
    absl::StatusOr<std::unique_ptr<Client>> client = server_.connect(GetParam());
    ASSERT_TRUE(client.ok()) << client.status();
    client_ = *std::move(client);
    open({.reconnect = kPatient});
  }

  // Retry policy that keeps trying for longer than any test keeps its server stopped.
  static constexpr RetryPolicy kPatient = {
      .max_attempts = 1000, .first_backoff = absl::Milliseconds(1), .max_backoff = absl::Milliseconds(20)};

  void open(const QueryStreamOptions& options) { stream_ = client_->query_stream("arena", options); }

  // Sends a batch with `number` as max_work. The fake server returns max_work as the revision of its answer, so the
  // revision identifies the batch.
  std::future<absl::StatusOr<v1::QueryResult>> ask(uint64_t number) {
    v1::QueryBatch batch;
    batch.set_max_work(number);
    return stream_->send(std::move(batch));
  }

  // Sends a step whose update has the tick `tick`; `number` is the max_work of its queries.
  std::future<absl::StatusOr<StepResult>> step(uint64_t tick, uint64_t number = 1) {
    v1::UpdateBatch update;
    update.set_tick(tick);
    v1::QueryBatch queries;
    queries.set_max_work(number);
    return stream_->step(std::move(update), std::move(queries));
  }

  FakeServer server_;
  std::unique_ptr<Client> client_;
  std::unique_ptr<QueryStream> stream_;
};

// Tests that restart the server, which a client in the same process cannot reach again.
class QueryStreamRestartTest : public QueryStreamTest {};

TEST_P(QueryStreamTest, AnswersOutOfOrderReachTheirOwnBatches) {
  std::vector<std::future<absl::StatusOr<v1::QueryResult>>> answers;
  for (uint64_t number = 1; number <= 20; ++number) answers.push_back(ask(number));
  for (uint64_t number = 1; number <= 20; ++number) {
    const absl::StatusOr<v1::QueryResult> answer = answers[number - 1].get();
    ASSERT_TRUE(answer.ok()) << answer.status();
    EXPECT_EQ(answer->revision(), number);
  }
  EXPECT_TRUE(stream_->close().ok());
}

TEST_P(QueryStreamTest, ARefusedBatchDoesNotEndTheStream) {
  auto refused = ask(FakeQueries::kRefusedWork);
  auto answered = ask(7);
  const absl::Status status = refused.get().status();
  EXPECT_TRUE(absl::IsInvalidArgument(status));
  EXPECT_EQ(error_of(status)->reason(), v1::REASON_NOT_FINITE);
  EXPECT_EQ(answered.get()->revision(), 7u);
}

TEST_P(QueryStreamTest, AfterABreakUnansweredBatchesAreSentAgain) {
  server_.queries.failing_calls = 2;
  auto first = ask(1);
  auto second = ask(2);
  EXPECT_EQ(first.get()->revision(), 1u);
  EXPECT_EQ(second.get()->revision(), 2u);
}

TEST_P(QueryStreamTest, APermanentErrorReachesEveryUnansweredBatch) {
  server_.queries.failure = grpc::Status(grpc::StatusCode::PERMISSION_DENIED, "planned");
  server_.queries.failing_calls = 1;
  auto first = ask(1);
  auto second = ask(2);
  EXPECT_TRUE(absl::IsPermissionDenied(first.get().status()));
  EXPECT_TRUE(absl::IsPermissionDenied(second.get().status()));
}

TEST_P(QueryStreamRestartTest, ARestartedServerGetsTheRemainingBatches) {
  server_.queries.stream_answer = [](const v1::QueryBatch& batch) {
    v1::QueryResult result;
    result.set_revision(batch.max_work());
    return result;
  };
  EXPECT_EQ(ask(1).get()->revision(), 1u);
  server_.stop();
  std::vector<std::future<absl::StatusOr<v1::QueryResult>>> answers;
  for (uint64_t number = 2; number <= 6; ++number) answers.push_back(ask(number));
  server_.restart();
  for (uint64_t number = 2; number <= 6; ++number) {
    const absl::StatusOr<v1::QueryResult> answer = answers[number - 2].get();
    ASSERT_TRUE(answer.ok()) << answer.status();
    EXPECT_EQ(answer->revision(), number);
  }
}

TEST_P(QueryStreamTest, BatchesWithoutAnAnswerAreSentAgainOnANewConnection) {
  server_.queries.stream_answer = [](const v1::QueryBatch&) {
    v1::QueryResult result;
    result.set_revision(5);
    return result;
  };
  server_.queries.silent_messages = 1;
  open({.reconnect = kPatient, .patience = absl::Milliseconds(20)});
  EXPECT_EQ(ask(1).get()->revision(), 5u);
}

TEST_P(QueryStreamTest, AServerThatNeverAnswersBecomesUnavailable) {
  server_.queries.silent_messages = 1000;
  open({.reconnect = {.max_attempts = 3, .first_backoff = absl::Milliseconds(1)}, .patience = absl::Milliseconds(20)});
  auto answer = ask(1);
  EXPECT_TRUE(absl::IsUnavailable(answer.get().status()));
  EXPECT_TRUE(absl::IsUnavailable(stream_->close()));
}

TEST_P(QueryStreamTest, EitherLaneReachesTheServer) {
  server_.queries.stream_answer = [](const v1::QueryBatch&) {
    v1::QueryResult result;
    result.set_revision(3);
    return result;
  };
  for (const Lane lane : {Lane::kLatency, Lane::kBulk}) {
    open({.lane = lane});
    EXPECT_EQ(ask(1).get()->revision(), 3u);
  }
}

TEST_P(QueryStreamTest, AStepReturnsTheAckAndTheAnswer) {
  for (uint64_t tick = 1; tick <= 10; ++tick) {
    const absl::StatusOr<StepResult> outcome = step(tick).get();
    ASSERT_TRUE(outcome.ok()) << outcome.status();
    EXPECT_EQ(outcome->ack.revision(), tick);
    EXPECT_EQ(outcome->result->revision(), tick);
  }
  EXPECT_TRUE(stream_->close().ok());
}

TEST_P(QueryStreamTest, QueriesThatFailAfterTheirUpdateKeepTheAckAndTheNumber) {
  const absl::StatusOr<StepResult> failed = step(1, FakeQueries::kRefusedWork).get();
  ASSERT_TRUE(failed.ok()) << failed.status();
  EXPECT_EQ(failed->ack.revision(), 1u);
  EXPECT_TRUE(absl::IsInvalidArgument(failed->result.status()));
  EXPECT_EQ(error_of(failed->result.status())->reason(), v1::REASON_NOT_FINITE);
  EXPECT_EQ(step(2).get()->ack.revision(), 2u);
  EXPECT_EQ(server_.updates.gaps, 0);
}

// Steps with refused updates, broken streams, and queries between the steps: each step is applied once, in order.
TEST_P(QueryStreamTest, EachStepIsAppliedOnceDespiteRefusalsAndBreaks) {
  server_.queries.stream_answer = [](const v1::QueryBatch& batch) {
    v1::QueryResult result;
    result.set_revision(batch.max_work());
    return result;
  };
  server_.updates.refused_ticks = {3, 17, 18, 33};
  server_.updates.breaks = {.after_messages = 5, .times = 12, .apply_last = true};
  std::vector<std::future<absl::StatusOr<StepResult>>> steps;
  std::vector<std::future<absl::StatusOr<v1::QueryResult>>> queries;
  std::vector<uint64_t> expected;
  for (uint64_t tick = 1; tick <= 60; ++tick) {
    steps.push_back(step(tick));
    if (tick % 3 == 0) queries.push_back(ask(1000 + tick));
    if (!server_.updates.refused_ticks.contains(tick)) expected.push_back(tick);
  }
  EXPECT_TRUE(stream_->close().ok());
  for (uint64_t tick = 1; tick <= 60; ++tick) {
    const absl::StatusOr<StepResult> outcome = steps[tick - 1].get();
    if (server_.updates.refused_ticks.contains(tick))
      EXPECT_TRUE(absl::IsInvalidArgument(outcome.status())) << tick;
    else
      EXPECT_TRUE(outcome.ok()) << tick << ": " << outcome.status();
  }
  for (size_t i = 0; i < queries.size(); ++i) EXPECT_EQ(queries[i].get()->revision(), 1003 + 3 * i);
  EXPECT_EQ(server_.updates.applied(), expected);
}

// A step that was applied, and is refused when it is sent again, keeps its number. Otherwise the next step would get
// the number, and the server would take it for a repetition.
TEST_P(QueryStreamTest, ARepeatedStepThatIsRefusedKeepsTheNumberIfItWasApplied) {
  server_.updates.breaks = {.after_messages = 2, .times = 1, .apply_last = true};
  server_.updates.refused_repeats = {2};
  std::vector<std::future<absl::StatusOr<StepResult>>> steps;
  for (uint64_t tick = 1; tick <= 6; ++tick) steps.push_back(step(tick));
  EXPECT_TRUE(stream_->close().ok());
  for (uint64_t tick = 1; tick <= 6; ++tick) {
    const absl::StatusOr<StepResult> outcome = steps[tick - 1].get();
    EXPECT_EQ(outcome.ok(), tick != 2) << tick << ": " << outcome.status();
    if (outcome.ok()) {
      EXPECT_FALSE(outcome->ack.duplicate()) << tick;
      continue;
    }
    EXPECT_NE(outcome.status().message().find("may have been applied"), absl::string_view::npos) << outcome.status();
    EXPECT_FALSE(refused_by_server(outcome.status()));
  }
  EXPECT_EQ(server_.updates.applied(), (std::vector<uint64_t>{1, 2, 3, 4, 5, 6}));
}

TEST_P(QueryStreamTest, TheNumberOfARepeatedStepIsUsedAgainIfItWasNotApplied) {
  server_.updates.breaks = {.after_messages = 2, .times = 1, .apply_last = false};
  server_.updates.refused_repeats = {2};
  std::vector<std::future<absl::StatusOr<StepResult>>> steps;
  for (uint64_t tick = 1; tick <= 6; ++tick) steps.push_back(step(tick));
  EXPECT_TRUE(stream_->close().ok());
  for (uint64_t tick = 1; tick <= 6; ++tick) EXPECT_EQ(steps[tick - 1].get().ok(), tick != 2) << tick;
  EXPECT_EQ(server_.updates.applied(), (std::vector<uint64_t>{1, 3, 4, 5, 6}));
  EXPECT_EQ(server_.updates.duplicates, 0);
}

TEST_P(QueryStreamTest, AStepWithoutTheRightToUpdateDoesNotEndTheStream) {
  server_.updates.denied_ticks = {2};
  std::vector<std::future<absl::StatusOr<StepResult>>> steps;
  for (uint64_t tick = 1; tick <= 4; ++tick) steps.push_back(step(tick));
  EXPECT_TRUE(stream_->close().ok());
  EXPECT_TRUE(absl::IsPermissionDenied(steps[1].get().status()));
  EXPECT_EQ(server_.updates.applied(), (std::vector<uint64_t>{1, 3, 4}));
}

TEST_P(QueryStreamTest, AServerThatForgotTheWriterEndsTheStream) {
  ASSERT_TRUE(step(1).get().ok());
  server_.updates.forget_writers();
  const absl::Status status = step(2).get().status();
  EXPECT_EQ(error_of(status)->reason(), v1::REASON_BATCH_GAP);
  EXPECT_TRUE(absl::IsFailedPrecondition(stream_->close()));
}

TEST_P(QueryStreamTest, AStreamContinuesTheNumbersOfAnEarlierWriter) {
  open({.writer = 77});
  ASSERT_TRUE(step(1).get().ok());
  open({.writer = 77, .next_batch = 2});
  ASSERT_TRUE(step(2).get().ok());
  EXPECT_EQ(server_.updates.last_batch.writer(), 77u);
  EXPECT_EQ(server_.updates.last_batch.batch(), 2u);
}

INSTANTIATE_TEST_SUITE_P(Ways, QueryStreamRestartTest, ::testing::Values(testing::Way::kLoopback), testing::way_name);
INSTANTIATE_TEST_SUITE_P(Ways, QueryStreamTest, testing::kBothWays, testing::way_name);

}  // namespace
}  // namespace locus::client
