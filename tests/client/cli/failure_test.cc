#include "client/cli/failure.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "absl/strings/match.h"
#include "client/lib/status.h"

namespace locus::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

absl::Status not_finite() {
  v1::Error error;
  error.set_code(static_cast<int>(absl::StatusCode::kInvalidArgument));
  error.set_message("blocks[0].rays.origins[2]: not finite");
  error.set_reason(v1::REASON_NOT_FINITE);
  error.set_field("blocks[0].rays.origins");
  error.set_index(2);
  return client::to_absl_status(error);
}

TEST(FailureTest, EachKindOfFailureHasItsExitCode) {
  EXPECT_EQ(exit_code_of(absl::OkStatus()), ExitCode::kOk);
  EXPECT_EQ(exit_code_of(absl::InternalError("")), ExitCode::kFailed);
  EXPECT_EQ(exit_code_of(not_finite()), ExitCode::kFailed) << "the server refused; the line itself was fine";
  EXPECT_EQ(exit_code_of(usage_error("x")), ExitCode::kUsage);
  EXPECT_EQ(exit_code_of(absl::UnavailableError("")), ExitCode::kUnreachable);
  EXPECT_EQ(exit_code_of(absl::PermissionDeniedError("")), ExitCode::kDenied);
  EXPECT_EQ(exit_code_of(absl::UnauthenticatedError("")), ExitCode::kDenied);
  EXPECT_EQ(exit_code_of(absl::NotFoundError("")), ExitCode::kNotFound);
}

TEST(FailureTest, TextHasAnErrorLineAndAHintLine) {
  std::ostringstream err;
  write_failure(err, Format::kTable, absl::DeadlineExceededError("too slow"));
  EXPECT_THAT(err.str(), HasSubstr("error: too slow\n"));
  EXPECT_THAT(err.str(), HasSubstr("hint: give it more time with --timeout"));
}

TEST(FailureTest, OnlyAChangeMayHaveBeenMadeAfterItsDeadline) {
  std::ostringstream change, query;
  write_failure(change, Format::kTable, absl::DeadlineExceededError("Deadline Exceeded"));
  write_failure(query, Format::kTable, with_place(client::mark_read_only(absl::DeadlineExceededError("late")), "a:1"));
  EXPECT_THAT(change.str(), HasSubstr("a change may have been made"));
  EXPECT_THAT(query.str(), Not(HasSubstr("a change")));
}

TEST(FailureTest, JsonHasTheFieldsOfTheStructuredError) {
  std::ostringstream err;
  write_failure(err, Format::kJson, not_finite());
  const Json error = Json::parse(err.str())["error"];
  EXPECT_EQ(error["code"], "INVALID_ARGUMENT");
  EXPECT_EQ(error["reason"], "NOT_FINITE");
  EXPECT_EQ(error["field"], "blocks[0].rays.origins");
  EXPECT_EQ(error["index"], 2);
}

TEST(FailureTest, AnAckThatRefusedNothingIsSuccess) { EXPECT_TRUE(refused_items(v1::UpdateAck()).ok()); }

TEST(FailureTest, RefusedItemsAreNotFoundOnlyIfAllIdsAreUnknown) {
  v1::UpdateAck ack;
  ack.set_applied(1);
  ack.set_refused(1);
  v1::ItemError& item = *ack.add_errors();
  item.set_field("moves[0].ids");
  item.set_index(1);
  item.set_id(8);
  item.set_reason(v1::REASON_UNKNOWN_ID);
  EXPECT_TRUE(absl::IsNotFound(refused_items(ack)));
  EXPECT_THAT(std::string(refused_items(ack).message()),
              HasSubstr("1 of 2 items refused; the first is moves[0].ids[1], id 8: UNKNOWN_ID"));
  item.set_reason(v1::REASON_NOT_FINITE);
  EXPECT_TRUE(absl::IsFailedPrecondition(refused_items(ack)));
}

TEST(FailureTest, FailureNameIsUsageTheReasonOrTheCode) {
  EXPECT_EQ(failure_name(not_finite()), "NOT_FINITE");
  EXPECT_EQ(failure_name(usage_error("x")), "USAGE");
  EXPECT_EQ(failure_name(absl::NotFoundError("x")), "NOT_FOUND") << "no reason, so the code";
  for (const char* name : {"NOT_FINITE", "USAGE", "NOT_FOUND", "UNAUTHENTICATED"}) EXPECT_TRUE(is_failure_name(name));
  for (const char* name : {"", "OK", "UNSPECIFIED", "not_found", "17"}) EXPECT_FALSE(is_failure_name(name)) << name;
}

TEST(FailureTest, WithPlaceKeepsNameAndExitCode) {
  const absl::Status placed = with_place(not_finite(), "x.locus:3");
  EXPECT_EQ(failure_name(placed), "NOT_FINITE");
  EXPECT_TRUE(absl::StartsWith(placed.message(), "x.locus:3: "));
  EXPECT_EQ(exit_code_of(with_place(usage_error("x"), "y")), ExitCode::kUsage);
}

TEST(FailureTest, AnAlreadyPrintedErrorKeepsItsExitCode) {
  EXPECT_TRUE(is_reported(reported(absl::NotFoundError("x"))));
  EXPECT_FALSE(is_reported(absl::NotFoundError("x")));
  EXPECT_EQ(exit_code_of(reported(absl::NotFoundError("x"))), ExitCode::kNotFound);
}

}  // namespace
}  // namespace locus::cli
