#include "client/cli/extras/completion/table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace locus::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::SizeIs;

CommandWords program() {
  CommandWords draw{.path = "tool draw", .description = "Draw something"};
  draw.options = {{.names = {"--help"}, .description = "Help of draw"},
                  {.names = {"-o", "--out"}, .value = "FILE", .kind = ValueKind::kFile, .description = "Where\nto"}};
  draw.positionals = {
      {.value = "SHAPE", .kind = ValueKind::kChoice, .choices = {"ball", "box"}, .description = "What"}};
  CommandWords tool{.path = "tool", .description = "A tool"};
  tool.options = {{.names = {"--help"}, .description = "Help"}, {.names = {"-v"}, .value = "N", .description = "More"}};
  tool.commands = {draw};
  return tool;
}

TEST(CompletionTableTest, ACommandListsItsSubcommandsAndOptions) {
  const std::vector<TableEntry> table = completion_table(program());
  ASSERT_THAT(table, SizeIs(2));
  EXPECT_EQ(table[0].path, "tool");
  EXPECT_THAT(table[0].lines,
              ElementsAre("command\tdraw\t-\tDraw something", "option\t--help\t-\tHelp", "option\t-v\tany\tMore"));
}

TEST(CompletionTableTest, InheritedOptionsComeLastUnlessTheCommandRedefinesThem) {
  EXPECT_THAT(completion_table(program())[1].lines,
              ElementsAre("positional\tSHAPE\tchoice ball box\tWhat", "option\t--help\t-\tHelp of draw",
                          "option\t-o\tfile\tWhere to", "option\t--out\tfile\tWhere to", "option\t-v\tany\tMore"));
}

}  // namespace
}  // namespace locus::cli
