#include "server/rpc/library_logs.h"

#include <gmock/gmock.h>
#include <grpc/support/log.h>

#include <algorithm>
#include <string>

#include "server/config/observability_limits.h"
#include "server/observability/log.h"

namespace locus::server {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(LibraryLogsTest, AFloodOfErrorsIsAFewLines) {
  start_logging(LogLevel::kInfo, LogFormat::kText);
  capture_library_logs(LogLevel::kWarning);
  gpr_set_log_verbosity(GPR_LOG_SEVERITY_INFO);
  testing::internal::CaptureStderr();
  for (int i = 0; i < 1000; ++i) gpr_log(GPR_ERROR, "handshake failed");
  gpr_log(GPR_INFO, "a detail");
  const std::string text = testing::internal::GetCapturedStderr();
  gpr_set_log_verbosity(GPR_LOG_SEVERITY_ERROR);
  start_logging(LogLevel::kWarning, LogFormat::kText);
  EXPECT_THAT(text, HasSubstr("handshake failed"));
  EXPECT_THAT(text, Not(HasSubstr("a detail")));
  // The flood of messages may last several seconds on a busy machine, and the limit is per second.
  EXPECT_LT(std::count(text.begin(), text.end(), '\n'), 20 * kMaxLibraryLines);
}

}  // namespace
}  // namespace locus::server
