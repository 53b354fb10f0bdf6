// Tests of `locus token` against the documented format of locusd's token files, parsed here word by word.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <sstream>
#include <string>
#include <vector>

#include "absl/strings/str_split.h"
#include "absl/time/clock.h"
#include "client/cli/run.h"
#include "tests/support/sha256_hex.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/text_of.h"

namespace locus::test {
namespace {

using ::testing::MatchesRegex;

std::string run_token(const std::vector<std::string>& arguments) {
  std::ostringstream out;
  std::ostringstream err;
  cli::Context context(out, err, cli::Progress::kSilent);
  EXPECT_EQ(cli::run_line(arguments, context), cli::ExitCode::kOk) << err.str();
  return out.str();
}

std::vector<std::string> lines_of(const std::string& file) { return absl::StrSplit(text_of(file), '\n'); }

TEST(TokenTest, TheFileHasTheFormatThatLocusdReads) {
  const TemporaryFolder folder;
  const std::string file = folder.file("tokens");
  std::string token =
      run_token({"token", "create", "lobby-1", "--token-file", file, "--expires", "30d", "--comment", "two  words"});
  ASSERT_EQ(token.back(), '\n');
  token.pop_back();
  run_token({"token", "create", "arena", "--token-file", file});
  EXPECT_THAT(token, MatchesRegex("locus_lobby-1_[A-Za-z0-9_-]+"));
  EXPECT_EQ(token.size(), std::string("locus_lobby-1_").size() + 43);

  const std::vector<std::string> lines = lines_of(file);
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_EQ(lines[2], "") << "each line has its line break";
  const std::vector<std::string> words = absl::StrSplit(lines[0], absl::MaxSplits(' ', 4));
  ASSERT_EQ(words.size(), 5u);
  EXPECT_EQ(words[0], "lobby-1");
  EXPECT_EQ(words[1], sha256_hex(token));
  absl::Time created;
  absl::Time expires;
  std::string error;
  for (const auto& [word, time] : {std::pair(words[2], &created), std::pair(words[3], &expires)}) {
    ASSERT_TRUE(absl::ParseTime(absl::RFC3339_sec, word, time, &error)) << word << ": " << error;
    EXPECT_EQ(absl::FormatTime("%Y-%m-%dT%H:%M:%SZ", *time, absl::UTCTimeZone()), word) << "canonical";
  }
  EXPECT_LE(created, absl::Now());
  EXPECT_EQ(expires - created, absl::Hours(30 * 24));
  EXPECT_EQ(words[4], "two  words");
  EXPECT_THAT(lines[1], MatchesRegex("arena [0-9a-f]+ [0-9TZ:-]+ never"));
  struct stat status {};
  ASSERT_EQ(::stat(file.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777, 0600u) << "locusd refuses files that others can write";
}

}  // namespace
}  // namespace locus::test
