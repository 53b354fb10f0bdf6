// Wrong lines of users, against a real server: each answer must name what is wrong and what to do. The lines and their
// answers are in tests/golden/wrong_lines.txt. If an answer differs, the test writes all answers to
// golden/wrong_lines.txt in the build directory; if the new answers are better, copy that file.
#include <filesystem>
#include <fstream>
#include <sstream>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client/cli/run.h"
#include "tests/support/cli_outcome.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

class WrongLinesTest : public RpcTest {
 protected:
  Outcome run(std::vector<std::string> arguments) {
    if (arguments.front() != "-a") arguments.insert(arguments.begin(), {"--address", running_.address()});
    std::ostringstream out, err;
    cli::Context context(out, err, cli::Progress::kSilent);
    const cli::ExitCode code = cli::run_line(arguments, context);
    return {code, out.str(), err.str()};
  }
};

std::string text_of_file(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

TEST_F(WrongLinesTest, EachAnswerNamesTheMistakeAndARemedy) {
  const std::string golden = text_of_file(absl::StrCat(LOCUS_SOURCE_DIR, "/tests/golden/wrong_lines.txt"));
  ASSERT_EQ(run({"insert", "world", "ball", "--id", "7", "--at", "0,0,0", "--radius", "1"}).code, cli::ExitCode::kOk);
  std::string answers;
  int lines = 0;
  for (const absl::string_view line : absl::StrSplit(golden, '\n')) {
    constexpr absl::string_view kPrompt = "$ locus ";
    if (!absl::StartsWith(line, kPrompt)) continue;
    ++lines;
    const Outcome outcome = run(absl::StrSplit(line.substr(kPrompt.size()), ' ', absl::SkipEmpty()));
    EXPECT_NE(outcome.code, cli::ExitCode::kOk) << line;
    EXPECT_TRUE(absl::StartsWith(outcome.err, "error: ")) << line << '\n' << outcome.err;
    absl::StrAppend(&answers, line, "\n", outcome.err, "exit code ", static_cast<int>(outcome.code), "\n\n");
  }
  EXPECT_GE(lines, 40);
  if (answers == golden) return;
  const std::string written = absl::StrCat(LOCUS_BINARY_DIR, "/golden/wrong_lines.txt");
  std::filesystem::create_directories(absl::StrCat(LOCUS_BINARY_DIR, "/golden"));
  std::ofstream(written) << answers;
  ADD_FAILURE() << "answers differ; all answers are in " << written;
}

}  // namespace
}  // namespace locus::test
