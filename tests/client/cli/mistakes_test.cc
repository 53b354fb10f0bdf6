#include "client/cli/mistakes.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"

namespace locus::cli {
namespace {

class MistakesTest : public ::testing::Test {
 protected:
  MistakesTest() {
    app_.name("tool");
    app_.require_subcommand(1);
    app_.fallthrough();
    app_.add_option("-o,--output", output_);
    CLI::App& scene = *app_.add_subcommand("scene", "");
    scene.require_subcommand(1);
    scene.add_subcommand("list", "");
    CLI::App& describe = *scene.add_subcommand("describe", "");
    describe.add_option("NAME", name_)->required();
    describe.add_option("--at-least", number_);
    describe.add_option("--old", number_)->group("");
    scene.add_subcommand("secret", "")->group("");
  }

  // Returns the mistake in a line that the parser must refuse.
  Mistake mistake(const std::string& line) {
    const std::vector<std::string> arguments = absl::StrSplit(line, ' ', absl::SkipEmpty());
    try {
      app_.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
    } catch (const CLI::ParseError& error) {
      return mistake_in(app_, arguments, error);
    }
    ADD_FAILURE() << "the parser accepts " << line;
    return {};
  }

  CLI::App app_;
  std::string output_, name_;
  int number_ = 0;
};

TEST_F(MistakesTest, AnUnknownCommandIsNamedWithTheNearestOne) {
  EXPECT_EQ(mistake("sceen list").message, "`tool` has no command `sceen`; did you mean `scene`?");
  EXPECT_EQ(mistake("scene ls").message, "`tool scene` has no command `ls`; did you mean `list`?");
  EXPECT_EQ(mistake("scene ls").command, "tool scene");
  EXPECT_EQ(mistake("-o json scene ls").message, "`tool scene` has no command `ls`; did you mean `list`?");
  EXPECT_EQ(mistake("scene frob").message, "`tool scene` has no command `frob`; its commands are list, describe");
}

TEST_F(MistakesTest, AMissingCommandIsListed) {
  EXPECT_EQ(mistake("").message, "`tool` needs a command: scene");
  EXPECT_EQ(mistake("scene").message, "`tool scene` needs a command: list, describe");
  EXPECT_EQ(mistake("--output json").message, "`tool` needs a command: scene");
}

TEST_F(MistakesTest, AnUnknownOptionIsNamedWithTheNearestOneOfTheCommandOrTheProgram) {
  EXPECT_EQ(mistake("scene describe a --at-last 1").message,
            "`tool scene describe` has no option `--at-last`; did you mean `--at-least`?");
  EXPECT_EQ(mistake("scene describe a --ouput=json").message,
            "`tool scene describe` has no option `--ouput`; did you mean `--output`?");
  EXPECT_EQ(mistake("scene describe a -output json").message,
            "`json` is unexpected: `tool scene describe` takes 1 word "
            "besides its options");
  EXPECT_EQ(mistake("scene describe a --odl 1").message, "`tool scene describe` has no option `--odl`")
      << "hidden options are not suggested";
}

TEST_F(MistakesTest, AnUnexpectedWordIsNamed) {
  EXPECT_EQ(mistake("scene describe a b c").message,
            "`b` is unexpected: `tool scene describe` takes 1 word besides its options");
}

TEST_F(MistakesTest, OtherMistakesHaveTheMessageOfTheParser) {
  EXPECT_EQ(mistake("scene describe").message, "NAME is required");
  EXPECT_EQ(mistake("scene describe a --at-least x").message, "--at-least INT: cannot read 'x'");
  EXPECT_EQ(mistake("scene describe a --at-least x").command, "tool scene describe");
}

TEST_F(MistakesTest, ALongWordIsCut) { EXPECT_LT(mistake(std::string(1'000'000, 'x')).message.size(), 200u); }

}  // namespace
}  // namespace locus::cli
