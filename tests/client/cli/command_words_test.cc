#include "client/cli/command_words.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "client/cli/choices.h"
#include "client/cli/run.h"

namespace locus::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// Fixture with a parser that has one option of each kind.
class CommandWordsTest : public ::testing::Test {
 protected:
  CommandWordsTest() {
    app_.name("tool");
    CLI::App& draw = *app_.add_subcommand("draw", "Draw something");
    draw.footer("Examples:\n  tool draw");
    draw.add_option("SHAPE", text_, "What")->required()->check(choices({"ball", "box"}));
    draw.add_option("-o,--out", text_, "Where to")->type_name("FILE");
    draw.add_option("--scene", text_, "Which")->type_name("SCENE");
    draw.add_option("--layers", list_, "Some")->delimiter(',')->check(choices({"low", "high"}));
    draw.add_option("--secret", text_, "Not to be seen")->group("");
    draw.add_flag("--fast", flag_, "Be quick");
    draw.add_option_group("more")->add_option("--depth", text_, "How deep")->default_str("3");
    app_.add_subcommand("debug", "Not to be seen")->group("");
  }

  std::string text_;
  bool flag_ = false;
  std::vector<std::string> list_;
  CLI::App app_;
};

TEST_F(CommandWordsTest, ACommandHasItsPathDescriptionAndFooter) {
  const CommandWords words = words_of(app_);
  EXPECT_EQ(words.path, "tool");
  ASSERT_THAT(words.commands, SizeIs(1)) << "what is hidden stays hidden";
  EXPECT_EQ(words.commands[0].path, "tool draw");
  EXPECT_EQ(words.commands[0].description, "Draw something");
  EXPECT_EQ(words.commands[0].footer, "Examples:\n  tool draw");
}

TEST_F(CommandWordsTest, OptionsKeepTheirOrderAndIncludeThoseOfOptionGroups) {
  std::vector<std::string> names;
  const CommandWords draw = words_of(app_).commands[0];
  for (const OptionWords& option : draw.options) names.push_back(option.names.back());
  EXPECT_THAT(names, ElementsAre("--help", "--out", "--scene", "--layers", "--fast", "--depth"));
}

TEST(CommandWordsOfLocusTest, DirectoriesOfBackupsAreCompletedAsPaths) {
  std::ostringstream nowhere;
  Context context(nowhere, nowhere, Progress::kSilent);
  CLI::App app;
  build_cli(app, context);
  size_t paths = 0;
  for (const CommandWords& command : words_of(app).commands) {
    if (command.path != "locus backup" && command.path != "locus restore") continue;
    for (const OptionWords& positional : command.positionals) {
      EXPECT_EQ(positional.kind, ValueKind::kFile) << command.path << " " << positional.value;
      ++paths;
    }
  }
  EXPECT_EQ(paths, 3u);
}

TEST_F(CommandWordsTest, AnOptionHasItsNamesValueKindAndDefault) {
  const CommandWords draw = words_of(app_).commands[0];
  const OptionWords& out = *find_option(draw, "-o");
  EXPECT_THAT(out.names, ElementsAre("-o", "--out"));
  EXPECT_EQ(out.value, "FILE");
  EXPECT_EQ(out.kind, ValueKind::kFile);
  EXPECT_EQ(find_option(draw, "--scene")->kind, ValueKind::kScene);
  EXPECT_EQ(find_option(draw, "--layers")->kind, ValueKind::kListOfChoices);
  EXPECT_THAT(find_option(draw, "--layers")->choices, ElementsAre("low", "high"));
  EXPECT_EQ(find_option(draw, "--depth")->default_text, "3");
  EXPECT_EQ(find_option(draw, "--fast")->value, "") << "a flag takes nothing";
  EXPECT_EQ(find_option(draw, "--secret"), nullptr);
}

TEST_F(CommandWordsTest, APositionalHasItsNameAsValueAndNoOptionNames) {
  const CommandWords draw = words_of(app_).commands[0];
  ASSERT_THAT(draw.positionals, SizeIs(1));
  EXPECT_THAT(draw.positionals[0].names, IsEmpty());
  EXPECT_EQ(draw.positionals[0].value, "SHAPE");
  EXPECT_EQ(draw.positionals[0].kind, ValueKind::kChoice);
  EXPECT_TRUE(draw.positionals[0].required);
}

void expect_examples(const CommandWords& command) {
  EXPECT_THAT(command.footer, HasSubstr("Examples:\n  ")) << command.path;
  EXPECT_THAT(command.footer, HasSubstr("locus")) << command.path;
  EXPECT_FALSE(command.description.empty()) << command.path;
  for (const OptionWords& option : command.options) EXPECT_FALSE(option.description.empty()) << command.path;
  for (const CommandWords& below : command.commands) expect_examples(below);
}

TEST(CommandWordsOfLocusTest, EveryCommandHasADescriptionAndExamples) {
  std::ostringstream ignored;
  Context context(ignored, ignored, Progress::kSilent);
  CLI::App app;
  build_cli(app, context);
  const CommandWords words = words_of(app);
  EXPECT_GE(words.commands.size(), 13u);
  expect_examples(words);
}

}  // namespace
}  // namespace locus::cli
