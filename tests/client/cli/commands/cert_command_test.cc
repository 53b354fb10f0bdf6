#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "client/cli/run.h"
#include "tests/support/temporary_folder.h"

namespace locus::cli {
namespace {

using ::testing::HasSubstr;

class CertCommandTest : public ::testing::Test {
 protected:
  ExitCode make(std::vector<std::string> line, const std::vector<std::string>& more = {}) {
    out_.str("");
    err_.str("");
    Context context(out_, err_, Progress::kSilent);
    line.insert(line.begin(), "cert");
    line.push_back(folder_.file("certs"));
    line.insert(line.end(), more.begin(), more.end());
    return run_line(line, context);
  }

  const test::TemporaryFolder folder_;
  std::ostringstream out_;
  std::ostringstream err_;
};

TEST_F(CertCommandTest, AuthorityServerAndClientAreMadeAndTheNextLineIsPrinted) {
  ASSERT_EQ(make({"authority"}), ExitCode::kOk) << err_.str();
  EXPECT_THAT(out_.str(), HasSubstr("locus cert server " + folder_.file("certs")));
  ASSERT_EQ(make({"server"}, {"--name", "localhost", "--address", "127.0.0.1"}), ExitCode::kOk) << err_.str();
  EXPECT_THAT(out_.str(), HasSubstr("locusd --tls-cert " + folder_.file("certs/server.pem")));
  ASSERT_EQ(make({"client"}, {"--name", "lobby", "--days", "7"}), ExitCode::kOk) << err_.str();
  EXPECT_THAT(out_.str(), HasSubstr("--cert " + folder_.file("certs/lobby.pem")));
  EXPECT_EQ(make({"authority"}), ExitCode::kFailed) << "nothing is overwritten";
  EXPECT_EQ(make({"client"}, {"--name", "lobby"}), ExitCode::kFailed);
}

TEST_F(CertCommandTest, WithoutAnAuthorityNothingIsSigned) {
  EXPECT_EQ(make({"server"}, {"--name", "localhost"}), ExitCode::kNotFound);
  EXPECT_THAT(err_.str(), HasSubstr("ca.pem"));
}

TEST_F(CertCommandTest, NamesThatLeadElsewhereAreUsageErrors) {
  ASSERT_EQ(make({"authority"}), ExitCode::kOk);
  for (const char* name : {"../lobby", "a/b", ".hidden", "ca", "server", ""})
    EXPECT_EQ(make({"client"}, {"--name", name}), ExitCode::kUsage) << name;
  EXPECT_EQ(make({"server"}), ExitCode::kUsage) << "no name and no address";
  EXPECT_EQ(make({"authority"}, {"--days", "0"}), ExitCode::kUsage);
}

}  // namespace
}  // namespace locus::cli
