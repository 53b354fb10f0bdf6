#include "client/cli/shell/input.h"

#include <gtest/gtest.h>

namespace locus::cli {
namespace {

TEST(InputTest, CommandsAndLuaAreDistinguished) {
  const std::vector<TableEntry> table = {
      {"locus", {}}, {"locus scene", {}}, {"locus query", {}}, {"locus query ray", {}}};
  const struct {
    const char* line;
    InputKind kind;
  } cases[] = {
      {"", InputKind::kNothing},
      {"   ", InputKind::kNothing},
      {"scene list", InputKind::kCommand},
      {"  query ray arena", InputKind::kCommand},
      {"scene", InputKind::kCommand},
      {"--version", InputKind::kCommand},
      {"scene = locus.scene('a')", InputKind::kLua},
      {"query('x')", InputKind::kLua},
      {"scene ('x')", InputKind::kLua},
      {"ray", InputKind::kLua},
      {"print(1)", InputKind::kLua},
      {"1 + 1", InputKind::kLua},
      {"--[[ a comment ]]", InputKind::kLua},
      {"-- a comment", InputKind::kLua},
      {"help", InputKind::kHelp},
      {"help query ray", InputKind::kHelp},
      {"help = 1", InputKind::kLua},
      {"use arena", InputKind::kUse},
      {"use = 1", InputKind::kLua},
      {"use", InputKind::kLua},
      {"exit", InputKind::kEnd},
      {" quit ", InputKind::kEnd},
      {"exit = 1", InputKind::kLua},
  };
  for (const auto& [line, kind] : cases) EXPECT_EQ(kind_of_input(line, table), kind) << line;
}

TEST(InputTest, TheProgramsNameMayPrecedeACommand) {
  const std::vector<TableEntry> table = {{"locus", {}}, {"locus scene", {}}};
  EXPECT_EQ(without_program("locus scene list", table), "scene list");
  EXPECT_EQ(without_program("locus.scene('a')", table), "locus.scene('a')");
  EXPECT_EQ(without_program("locus = 1", table), "locus = 1");
}

TEST(InputTest, TheNearestCommandIsNamed) {
  const std::vector<TableEntry> table = {
      {"locus", {}}, {"locus limits", {}}, {"locus query", {}}, {"locus query ray", {}}};
  EXPECT_EQ(unknown_command("qurey ray arena", table), "`qurey` is no command; did you mean `query`?");
  EXPECT_EQ(unknown_command(" limts ", table), "`limts` is no command; did you mean `limits`?");
  EXPECT_EQ(unknown_command("nonsense", table), "");
  EXPECT_EQ(unknown_command("limts = (1", table), "") << "Lua with a mistake";
}

}  // namespace
}  // namespace locus::cli
