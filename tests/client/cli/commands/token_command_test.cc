#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "client/cli/run.h"
#include "tests/support/temporary_folder.h"

namespace locus::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::Not;

TEST(TokenCommandTest, ATokenIsPrintedAloneListedWithoutSecretsAndRevoked) {
  const test::TemporaryFolder folder;
  const std::string file = folder.file("tokens");
  std::ostringstream out;
  std::ostringstream err;
  Context context(out, err, Progress::kSilent);
  const auto token_line = [&](std::vector<std::string> line) {
    out.str("");
    err.str("");
    line.insert(line.begin(), "token");
    line.insert(line.end(), {"--token-file", file});
    return run_line(line, context);
  };
  ASSERT_EQ(token_line({"create", "lobby", "--expires", "30d", "--comment", "of the game"}), ExitCode::kOk)
      << err.str();
  const std::string token = out.str();
  EXPECT_THAT(token, MatchesRegex("locus_lobby_[A-Za-z0-9_-]+\n"));
  EXPECT_THAT(err.str(), HasSubstr("only this once"));
  EXPECT_EQ(token_line({"create", "lobby"}), ExitCode::kFailed) << "the id is in use";
  EXPECT_EQ(out.str(), "");
  EXPECT_EQ(token_line({"create", "other", "--expires", "soon"}), ExitCode::kUsage);
  ASSERT_EQ(token_line({"list"}), ExitCode::kOk);
  EXPECT_THAT(out.str(), HasSubstr("of the game"));
  EXPECT_THAT(out.str(), Not(HasSubstr("locus_")));
  ASSERT_EQ(token_line({"revoke", "lobby"}), ExitCode::kOk);
  EXPECT_EQ(token_line({"revoke", "lobby"}), ExitCode::kNotFound);
}

}  // namespace
}  // namespace locus::cli
