#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "client/cli/run.h"
#include "tests/client/lib/fake_server.h"

namespace locus::cli {
namespace {

using ::testing::HasSubstr;

class QuotaCommandTest : public ::testing::Test {
 protected:
  ExitCode quota(const std::string& format, const std::vector<std::string>& more) {
    out_.str("");
    std::vector<std::string> line = {"-a", server_.address(), "-o", format, "quota"};
    line.insert(line.end(), more.begin(), more.end());
    return run_line(line, context_);
  }

  client::testing::FakeServer server_;
  std::ostringstream out_;
  std::ostringstream err_;
  Context context_{out_, err_, Progress::kSilent};
};

TEST_F(QuotaCommandTest, AnAbsentLimitIsUnlimited) {
  ASSERT_EQ(quota("json", {}), ExitCode::kOk) << err_.str();
  const Json rows = Json::parse(out_.str())["quotas"];
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0], Json::parse(R"({"identity":"token:a","quota":"scenes","limit":8,"used":3,"available":5})"));
  EXPECT_EQ(rows[1], Json::parse(R"({"identity":"token:a","quota":"objects","limit":null,"used":1000000,
                                     "available":null})"));
  ASSERT_EQ(quota("table", {}), ExitCode::kOk);
  EXPECT_THAT(out_.str(), HasSubstr("1000000"));
}

TEST_F(QuotaCommandTest, OneIdentityOrAllOfThemAreShown) {
  ASSERT_EQ(quota("csv", {"--identity", "jwt:eve"}), ExitCode::kOk) << err_.str();
  EXPECT_THAT(out_.str(), HasSubstr("jwt:eve,scenes,8,3,5\n"));
  ASSERT_EQ(quota("csv", {"--all"}), ExitCode::kOk) << err_.str();
  EXPECT_THAT(out_.str(), HasSubstr("token:a,scenes,8,3,5\n"));
  EXPECT_THAT(out_.str(), HasSubstr("token:b,scenes,8,3,5\n")) << "the second page";
  EXPECT_EQ(quota("csv", {"--all", "--identity", "jwt:eve"}), ExitCode::kUsage);
}

}  // namespace
}  // namespace locus::cli
