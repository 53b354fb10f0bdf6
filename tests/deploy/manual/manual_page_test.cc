#include "deploy/manual/manual_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace locus::manual {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

cli::CommandWords program() {
  cli::CommandWords draw{.path = "tool draw", .description = "Draw something"};
  draw.footer = "It takes a while.\n\nExamples:\n  tool draw ball\n  tool draw box --out a.png\n\nSee the book.";
  draw.options = {{.names = {"-o", "--out"}, .value = "FILE", .description = "Where to", .required = true},
                  {.names = {"--mode"}, .value = "MODE", .choices = {"fast", "fine"}, .description = "How"}};
  draw.positionals = {{.value = "SHAPE", .choices = {"ball", "box"}, .description = "ball or box", .required = true}};
  cli::CommandWords tool{.path = "tool", .description = "A tool"};
  tool.footer = "Examples:\n  tool draw ball";
  tool.commands = {draw};
  return tool;
}

Page page_of_draw() {
  return manual_pages(program(), {.section = "1",
                                  .version = "2.0",
                                  .exit_statuses = {{"0", "It went well."}},
                                  .variables = {{"TOOL_HOME", "Where it lives."}},
                                  .see_also = {"toold(8)"}})
      .at(1);
}

TEST(ManualPageTest, EveryCommandHasAPageOfItsOwn) {
  const std::vector<Page> pages = manual_pages(program(), {.section = "1", .version = "2.0"});
  ASSERT_THAT(pages, SizeIs(2));
  EXPECT_EQ(pages[0].file, "tool.1");
  EXPECT_EQ(pages[1].file, "tool-draw.1");
  EXPECT_THAT(pages[0].text, HasSubstr("\\fBtool\\-draw\\fR(1)\nDraw something."));
}

TEST(ManualPageTest, TheSynopsisShowsWhatIsRequired) {
  EXPECT_THAT(page_of_draw().text,
              HasSubstr("\\fBtool draw\\fR\n\\fB\\-\\-out\\fR \\fIFILE\\fR [\\fIOPTION\\fR]... \\fISHAPE\\fR\n"));
}

TEST(ManualPageTest, OptionsShowTheirValueAndChoices) {
  const std::string roff = page_of_draw().text;
  EXPECT_THAT(roff, HasSubstr("\\fB\\-o\\fR, \\fB\\-\\-out\\fR \\fIFILE\\fR\nWhere to. Required.\n"));
  EXPECT_THAT(roff, HasSubstr("How. One of fast, fine.\n"));
  EXPECT_THAT(roff, Not(HasSubstr("One of ball"))) << "the description names them already";
}

TEST(ManualPageTest, ExamplesStandApartFromTheOtherNotes) {
  const std::string roff = page_of_draw().text;
  EXPECT_THAT(roff, HasSubstr(".nf\ntool draw ball\ntool draw box \\-\\-out a.png\n.fi"));
  EXPECT_THAT(roff, HasSubstr("Draw something.\n.PP\nIt takes a while.\n.PP\nSee the book.\n"));
}

TEST(ManualPageTest, IndentedNotesAreKeptLiterally) {
  const cli::CommandWords tool{
      .path = "tool", .description = "Draws.", .footer = "Shapes:\n  ball   round\n  box\nLast."};
  const std::string roff = manual_pages(tool, {.section = "1", .version = "2.0"}).at(0).text;
  EXPECT_THAT(roff, HasSubstr("Shapes:\n.RS 2\n.nf\nball   round\nbox\n.fi\n.RE\nLast.\n"));
}

TEST(ManualPageTest, ADescriptionOfSeveralSentencesIsIndexedByItsFirst) {
  const cli::CommandWords tool{.path = "tool", .description = "Draws balls\nand boxes. Slowly."};
  const std::string roff = manual_pages(tool, {.section = "1", .version = "2.0"}).at(0).text;
  EXPECT_THAT(roff, HasSubstr(".SH NAME\ntool \\- Draws balls and boxes\n"));
  EXPECT_THAT(roff, HasSubstr(".SH DESCRIPTION\nDraws balls\nand boxes. Slowly.\n"));
}

TEST(ManualPageTest, ExitStatusesAndVariablesAreOnEveryPage) {
  const std::string roff = page_of_draw().text;
  EXPECT_THAT(roff, HasSubstr(".SH EXIT STATUS\n.TP\n\\fB0\\fR\nIt went well.\n"));
  EXPECT_THAT(roff, HasSubstr(".SH ENVIRONMENT\n.TP\n\\fBTOOL_HOME\\fR\nWhere it lives.\n"));
  EXPECT_THAT(roff, HasSubstr(".SH SEE ALSO\ntool(1),\ntoold(8)\n"));
}

}  // namespace
}  // namespace locus::manual
