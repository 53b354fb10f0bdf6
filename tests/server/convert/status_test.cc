#include "server/convert/status.h"

#include <gtest/gtest.h>

#include <string>

namespace locus::server {
namespace {

v1::Error error_in(const grpc::Status& status) {
  v1::Status details;
  v1::Error error;
  EXPECT_TRUE(details.ParseFromString(status.error_details()));
  EXPECT_EQ(details.code(), status.error_code());
  EXPECT_EQ(details.message(), status.error_message());
  EXPECT_EQ(details.details_size(), 1);
  if (details.details_size() == 1) {
    EXPECT_EQ(details.details(0).type_url(), "type.googleapis.com/locus.v1.Error");
    EXPECT_TRUE(details.details(0).UnpackTo(&error));
  }
  return error;
}

TEST(StatusTest, OkStaysOk) {
  EXPECT_TRUE(to_grpc(absl::OkStatus()).ok());
  EXPECT_TRUE(to_grpc(absl::OkStatus()).error_details().empty());
}

TEST(StatusTest, EveryPartOfARefusalArrives) {
  Refusal refusal;
  refusal.reason = Reason::kLimit;
  refusal.field = "blocks[2].rays.directions";
  refusal.index = 17;
  refusal.limit = "queries";
  refusal.limit_value = 65536;
  refusal.asked = 65537;
  refusal.retry_after_ms = 250;
  const grpc::Status status = to_grpc(refuse(absl::StatusCode::kResourceExhausted, "too many", refusal));
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(status.error_message(), "blocks[2].rays.directions[17]: too many");
  const v1::Error error = error_in(status);
  EXPECT_EQ(error.code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(error.message(), status.error_message());
  EXPECT_EQ(error.reason(), v1::REASON_LIMIT);
  EXPECT_EQ(error.field(), refusal.field);
  EXPECT_TRUE(error.has_index());
  EXPECT_EQ(error.index(), 17u);
  EXPECT_EQ(error.limit(), "queries");
  EXPECT_EQ(error.limit_value(), 65536);
  EXPECT_EQ(error.asked(), 65537);
  EXPECT_GE(error.retry_after_ms(), 250u);
  EXPECT_LE(error.retry_after_ms(), 312u);
}

TEST(StatusTest, EveryReasonHasItsNumberInTheProtocol) {
  for (int number = 0; number < v1::Reason_ARRAYSIZE; ++number) {
    const auto reason = static_cast<Reason>(number);
    EXPECT_EQ("REASON_" + std::string(reason_name(reason)), v1::Reason_Name(number));
    EXPECT_EQ(to_error(refuse_argument(reason, "x", {}, "no")).reason(), number);
  }
}

TEST(StatusTest, AnIndexOfZeroDiffersFromNoIndex) {
  EXPECT_TRUE(to_error(refuse_argument(Reason::kOutOfRange, "ids", 0, "no")).has_index());
  EXPECT_FALSE(to_error(refuse_argument(Reason::kOutOfRange, "ids", {}, "no")).has_index());
}

TEST(StatusTest, AStatusWithoutRefusalHasNoReason) {
  const v1::Error error = error_in(to_grpc(absl::InternalError("broken")));
  EXPECT_EQ(error.code(), grpc::StatusCode::INTERNAL);
  EXPECT_EQ(error.reason(), v1::REASON_UNSPECIFIED);
  EXPECT_EQ(error.message(), "broken");
}

TEST(StatusTest, LongTextsAreCutBetweenCharacters) {
  std::string text(1, 'x');
  for (int i = 0; i < 10000; ++i) text += "\xc3\xa4";
  const grpc::Status status = to_grpc(absl::InvalidArgumentError(text));
  EXPECT_LT(status.error_details().size() + status.error_message().size(), 4096u);
  EXPECT_EQ(status.error_message().size() % 2, 1u);
  EXPECT_EQ(error_in(status).message(), status.error_message());
}

TEST(StatusTest, NotServedNamesTheFieldAndDrainingHasARetryTime) {
  const v1::Error unserved = to_error(not_served("blocks[0].sight"));
  EXPECT_EQ(unserved.code(), grpc::StatusCode::UNIMPLEMENTED);
  EXPECT_EQ(unserved.reason(), v1::REASON_NOT_SERVED);
  EXPECT_EQ(unserved.field(), "blocks[0].sight");
  const v1::Error drained = to_error(draining());
  EXPECT_EQ(drained.code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(drained.reason(), v1::REASON_DRAINING);
  EXPECT_GT(drained.retry_after_ms(), 0u);
}

}  // namespace
}  // namespace locus::server
