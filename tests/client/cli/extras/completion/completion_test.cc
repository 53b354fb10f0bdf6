#include "client/cli/extras/completion/completion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace locus::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

CommandWords program_saying(const std::string& description) {
  CommandWords program{.path = "tool"};
  program.options = {{.names = {"--help"}, .description = description}};
  return program;
}

TEST(CompletionScriptTest, AnApostropheStaysText) {
  const CommandWords program = program_saying("the server's \\ own");
  for (const Shell shell : {Shell::kBash, Shell::kZsh})
    EXPECT_THAT(completion_script(program, shell), HasSubstr(R"(the server'\''s \ own')"));
  EXPECT_THAT(completion_script(program, Shell::kFish), HasSubstr(R"(the server\'s \\ own')"));
}

TEST(CompletionScriptTest, EveryFunctionIsNamedAfterTheProgram) {
  for (const Shell shell : {Shell::kBash, Shell::kZsh, Shell::kFish}) {
    EXPECT_THAT(completion_script(program_saying(""), shell), HasSubstr("_tool"));
    EXPECT_THAT(completion_script(program_saying(""), shell), Not(HasSubstr("NAME")));
  }
}

}  // namespace
}  // namespace locus::cli
