#include "client/cli/script/script.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/failure.h"
#include "client/cli/script/script_limits.h"

namespace locus::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string mistake(const std::string& text) {
  const absl::StatusOr<Script> script = parse_script("x.locus", text);
  if (script.ok()) return "";
  EXPECT_EQ(exit_code_of(script.status()), ExitCode::kUsage);
  return std::string(script.status().message());
}

TEST(ScriptTest, LinesBecomeStatementsWithTheirNumbers) {
  const absl::StatusOr<Script> script =
      parse_script("x.locus", "# title\n\n  let n = 3\r\n\tscene list\nexpect-error NOT_FOUND get --id 1\nletter\n");
  ASSERT_TRUE(script.ok()) << script.status();
  ASSERT_EQ(script->statements.size(), 4u);
  EXPECT_EQ(script->statements[0].verb, Verb::kLet);
  EXPECT_EQ(script->statements[0].text, "n = 3");
  EXPECT_EQ(place_of(*script, script->statements[0]), "x.locus:3");
  EXPECT_EQ(script->statements[1].verb, Verb::kCommand);
  EXPECT_EQ(script->statements[1].text, "scene list");
  EXPECT_EQ(script->statements[2].reason, "NOT_FOUND");
  EXPECT_EQ(script->statements[2].text, "get --id 1");
  EXPECT_EQ(script->statements[3].verb, Verb::kCommand) << "a word that only begins like let";
}

TEST(ScriptTest, BlocksAreLinkedToTheirOtherEnd) {
  const absl::StatusOr<Script> script = parse_script("x", "repeat 2\nbegin\nrepeat 3\ninsert point\nend\ncommit\nend");
  ASSERT_TRUE(script.ok()) << script.status();
  EXPECT_EQ(script->statements[0].partner, 6u);
  EXPECT_EQ(script->statements[1].partner, 5u);
  EXPECT_EQ(script->statements[4].partner, 2u);
}

TEST(ScriptTest, ACommitExpectedToFailClosesItsBatch) {
  const absl::StatusOr<Script> script = parse_script("x", "begin\nmove --id 1\nexpect-error UNKNOWN_ID commit");
  ASSERT_TRUE(script.ok()) << script.status();
  EXPECT_EQ(script->statements[2].verb, Verb::kCommit);
  EXPECT_EQ(script->statements[2].reason, "UNKNOWN_ID");
}

TEST(ScriptTest, UnclosedBlocksAreRefused) {
  EXPECT_EQ(mistake("let a = 1\nrepeat 2\n"), "x.locus:2: `repeat` without `end`");
  EXPECT_EQ(mistake("begin"), "x.locus:1: `begin` without `commit`");
  EXPECT_EQ(mistake("end"), "x.locus:1: `end` without `repeat`");
  EXPECT_EQ(mistake("commit"), "x.locus:1: `commit` without `begin`");
  EXPECT_EQ(mistake("begin\nrepeat 2\ncommit\nend"),
            "x.locus:3: `commit` while the block of line 2 is open: close that one first");
  EXPECT_EQ(mistake("repeat 2\nbegin\nend\ncommit"),
            "x.locus:3: `end` while the block of line 2 is open: close that one first");
}

TEST(ScriptTest, ABatchContainsOnlyChangesOfObjects) {
  for (const char* line : {"query ray", "scene list", "use hall", "begin", "expect-error NOT_FOUND get", "wait",
                           "expect-error UNKNOWN_ID move --id 1"}) {
    EXPECT_THAT(mistake(std::string("begin\n") + line + "\ncommit"),
                HasSubstr("is not allowed in the batch that begins in line 1: until commit, only insert, move, remove"))
        << line;
  }
  EXPECT_EQ(
      mistake("begin\ninsert a\nmove b\nremove c\nlet x = 1\necho hi\nexpect 1 == 1\nsleep 0\ncommit\nscene list"), "");
}

TEST(ScriptTest, ExpectErrorNamesAFailureAndHasACommand) {
  for (const char* name : {"UNKNOWN_ID", "NOT_FOUND", "DEADLINE_EXCEEDED", "UNAVAILABLE", "USAGE"}) {
    EXPECT_EQ(mistake(std::string("expect-error ") + name + " scene list"), "") << name;
  }
  for (const char* name : {"UNKNOWN", "OK", "UNSPECIFIED", "unknown_id", "REASON_UNKNOWN_ID", "BROKEN", ""}) {
    const bool is_code = std::string(name) == "UNKNOWN";
    EXPECT_EQ(mistake(std::string("expect-error ") + name + " scene list").empty(), is_code) << name;
  }
  for (const char* rest : {"", " # comment", " let a = 1", " end", " expect-error NOT_FOUND get"}) {
    EXPECT_THAT(mistake(std::string("expect-error NOT_FOUND") + rest),
                StartsWith("x.locus:1: expect-error REASON must be followed by a command or commit"))
        << rest;
  }
}

TEST(ScriptTest, EverythingHasALimit) {
  EXPECT_EQ(mistake("echo a\necho " + std::string(1'000'000, 'x')),
            "x.locus:2: the line has 1000005 bytes, at most 65536 are allowed");
  EXPECT_THAT(mistake(std::string(kMaxScriptLines + 1, '\n')), HasSubstr("at most 100000 lines"));
  EXPECT_THAT(mistake(std::string(kMaxScriptBytes + 1, ' ')), HasSubstr("at most 16777216 bytes"));
  std::string deep;
  for (size_t i = 0; i <= kMaxBlockNesting; ++i) deep += "repeat 2\n";
  EXPECT_EQ(mistake(deep), "x.locus:17: more than 16 nested blocks");
}

TEST(ScriptTest, ControlCharactersAreRefused) {
  EXPECT_EQ(mistake("echo a\x1a"), "x.locus:1: the line holds the control character 26");
  EXPECT_EQ(mistake(std::string("echo \0a", 7)), "x.locus:1: the line holds the control character 0");
  EXPECT_EQ(mistake("echo \xc3\xa9"), "") << "other alphabets are welcome";
}

TEST(ScriptTest, AnEmptyScriptIsAScript) { EXPECT_EQ(mistake(""), ""); }

}  // namespace
}  // namespace locus::cli
