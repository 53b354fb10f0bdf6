#include "client/lib/query_stream.h"

#include <gtest/gtest.h>

#include "client/lib/client.h"
#include "client/lib/status.h"
#include "tests/client/lib/fake_server.h"

namespace locus::client {
namespace {

using testing::FakeQueries;
using testing::FakeServer;

class QueryStreamTest : public ::testing::Test {
 protected:
  void SetUp() override {
    absl::StatusOr<std::unique_ptr<Client>> client = Client::connect(server_.address());
    ASSERT_TRUE(client.ok()) << client.status();
    stream_ = (*client)->query_stream("arena", {.reconnect = {.first_backoff = absl::Milliseconds(1)}});
  }

  // The fake answers with the work budget as the revision, so an answer shows whose it is.
  std::future<absl::StatusOr<v1::QueryResult>> ask(uint64_t number) {
    v1::QueryBatch batch;
    batch.set_max_work(number);
    return stream_->send(std::move(batch));
  }

  FakeServer server_;
  std::unique_ptr<QueryStream> stream_;
};

TEST_F(QueryStreamTest, AnswersOutOfOrderReachTheirOwnQuestions) {
  std::vector<std::future<absl::StatusOr<v1::QueryResult>>> answers;
  for (uint64_t number = 1; number <= 20; ++number) answers.push_back(ask(number));
  for (uint64_t number = 1; number <= 20; ++number) {
    const absl::StatusOr<v1::QueryResult> answer = answers[number - 1].get();
    ASSERT_TRUE(answer.ok()) << answer.status();
    EXPECT_EQ(answer->revision(), number);
  }
  EXPECT_TRUE(stream_->close().ok());
}

TEST_F(QueryStreamTest, ARefusedBatchDoesNotEndTheStream) {
  auto refused = ask(FakeQueries::kRefusedWork);
  auto answered = ask(7);
  const absl::Status status = refused.get().status();
  EXPECT_TRUE(absl::IsInvalidArgument(status));
  EXPECT_EQ(error_of(status)->reason(), v1::REASON_NOT_FINITE);
  EXPECT_EQ(answered.get()->revision(), 7u);
}

TEST_F(QueryStreamTest, AfterABreakUnansweredQuestionsAreAskedAgain) {
  server_.queries.failing_calls = 2;
  auto first = ask(1);
  auto second = ask(2);
  EXPECT_EQ(first.get()->revision(), 1u);
  EXPECT_EQ(second.get()->revision(), 2u);
}

TEST_F(QueryStreamTest, AnEndThatARetryCannotMendReachesEveryQuestion) {
  server_.queries.failure = grpc::Status(grpc::StatusCode::PERMISSION_DENIED, "planned");
  server_.queries.failing_calls = 1;
  auto first = ask(1);
  auto second = ask(2);
  EXPECT_TRUE(absl::IsPermissionDenied(first.get().status()));
  EXPECT_TRUE(absl::IsPermissionDenied(second.get().status()));
}

}  // namespace
}  // namespace locus::client
