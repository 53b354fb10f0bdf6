#include "server/observability/log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

namespace locus::server {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class LogTest : public ::testing::Test {
 protected:
  ~LogTest() override { start_logging(LogLevel::kWarning, LogFormat::kText); }

  static std::string line(LogFormat format) {
    start_logging(LogLevel::kInfo, format);
    testing::internal::CaptureStderr();
    log(LogLevel::kInfo, "happened", {{"to", "a \"thing\"\n"}});
    return testing::internal::GetCapturedStderr();
  }
};

TEST_F(LogTest, LinesOfACallHaveItsRequestIdAndTraceparent) {
  const LogScope scope({"abc", "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01"});
  EXPECT_THAT(line(LogFormat::kText),
              HasSubstr("info happened to=\"a \\\"thing\\\"\\u000a\" request_id=abc "
                        "traceparent=00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01\n"));
  EXPECT_THAT(
      line(LogFormat::kJson),
      HasSubstr("\"request_id\":\"abc\",\"traceparent\":\"00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01\"}"));
}

TEST_F(LogTest, WithoutATraceparentTheLineHasNone) {
  const LogScope scope({"abc", ""});
  EXPECT_THAT(line(LogFormat::kJson), HasSubstr("\"request_id\":\"abc\"}"));
}

TEST_F(LogTest, TheInnermostScopeIsUsedDuringItsLifetime) {
  {
    const LogScope outer({"outer", ""});
    {
      const LogScope inner({"inner", ""});
      EXPECT_THAT(line(LogFormat::kText), HasSubstr("request_id=inner"));
      EXPECT_EQ(LogScope::current().request_id, "inner");
    }
    EXPECT_THAT(line(LogFormat::kText), HasSubstr("request_id=outer"));
  }
  EXPECT_THAT(line(LogFormat::kText), Not(HasSubstr("request_id")));
  EXPECT_EQ(LogScope::current().request_id, "");
}

TEST_F(LogTest, AnotherThreadIsNotInTheScope) {
  const LogScope scope({"abc", ""});
  std::string other = "unset";
  std::thread([&other] { other = LogScope::current().request_id; }).join();
  EXPECT_EQ(other, "");
}

}  // namespace
}  // namespace locus::server
