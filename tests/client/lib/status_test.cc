#include "client/lib/status.h"

#include <gtest/gtest.h>

#include "tests/client/lib/fake_server.h"

namespace locus::client {
namespace {

TEST(StatusTest, DetailsOfAStatusAreReturnedAsTheErrorThatTheServerSent) {
  v1::Error sent;
  sent.set_reason(v1::REASON_LIMIT);
  sent.set_field("blocks[2].rays.directions");
  sent.set_index(17);
  sent.set_limit("max_queries");
  sent.set_limit_value(65536);
  sent.set_asked(70000);
  sent.set_retry_after_ms(250);
  const absl::Status status =
      to_absl_status(testing::refusal(grpc::StatusCode::RESOURCE_EXHAUSTED, "too many queries", sent));
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(status.message(), "too many queries");
  const std::optional<v1::Error> error = error_of(status);
  ASSERT_TRUE(error.has_value());
  EXPECT_EQ(error->reason(), v1::REASON_LIMIT);
  EXPECT_EQ(error->field(), "blocks[2].rays.directions");
  EXPECT_EQ(error->index(), 17u);
  EXPECT_EQ(error->asked(), 70000);
  EXPECT_EQ(retry_after(status), absl::Milliseconds(250));
  EXPECT_TRUE(refused_by_server(status));
}

TEST(StatusTest, WithoutDetailsThereIsNoError) {
  const absl::Status status = to_absl_status(grpc::Status(grpc::StatusCode::UNAVAILABLE, "gone"));
  EXPECT_TRUE(absl::IsUnavailable(status));
  EXPECT_FALSE(error_of(status).has_value());
  EXPECT_FALSE(refused_by_server(status));
  EXPECT_EQ(retry_after(status), absl::ZeroDuration());
}

TEST(StatusTest, MalformedDetailsAreDropped) {
  const absl::Status status = to_absl_status(grpc::Status(grpc::StatusCode::INTERNAL, "broken", "\xff\xff\xff"));
  EXPECT_TRUE(absl::IsInternal(status));
  EXPECT_FALSE(error_of(status).has_value());
}

TEST(StatusTest, AnErrorOnAStreamNeverBecomesSuccess) {
  v1::Error error;
  error.set_code(0);
  error.set_reason(v1::REASON_LIMIT);
  EXPECT_EQ(to_absl_status(error).code(), absl::StatusCode::kUnknown);
  error.set_code(99);
  EXPECT_EQ(to_absl_status(error).code(), absl::StatusCode::kUnknown);
  error.set_code(grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_TRUE(absl::IsInvalidArgument(to_absl_status(error)));
  EXPECT_EQ(error_of(to_absl_status(error))->reason(), v1::REASON_LIMIT);
}

TEST(StatusTest, SuccessStaysSuccess) { EXPECT_TRUE(to_absl_status(grpc::Status::OK).ok()); }

}  // namespace
}  // namespace locus::client
