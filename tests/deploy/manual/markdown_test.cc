#include "deploy/manual/markdown.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "deploy/manual/manual_page.h"
#include "deploy/manual/programs.h"

namespace locus::manual {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(MarkdownTest, NothingInATextIsMarkupButCode) {
  EXPECT_EQ(markdown_escaped("a_b *c* <d> [e] & x|y"), "a\\_b \\*c\\* &lt;d&gt; \\[e\\] &amp; x\\|y");
  EXPECT_EQ(markdown_escaped("run `locus_x <y>` or a lone ` _"), "run `locus_x <y>` or a lone ` \\_");
}

TEST(MarkdownTest, AnOptionIsADefinitionWhoseParagraphsAreIndented) {
  MarkdownPage page("tool");
  page.item(page.typed("--out") + " " + page.variable("FILE"), "Where to.\nOr not.\n\nSecond paragraph.");
  EXPECT_EQ(page.written(), "# tool\n\n`--out` *FILE*\n:   Where to.\n    Or not.\n\n    Second paragraph.\n");
}

TEST(MarkdownTest, ReferencesAreLinksToPagesOfTheSameFolder) {
  EXPECT_THAT(MarkdownPage("tool").references({"locus(1)", "locusd(8)"}).written(),
              HasSubstr("[locus(1)](locus.md),\n[locusd(8)](locusd.md)\n"));
}

TEST(MarkdownTest, AnExplanationAfterAnExampleBecomesAComment) {
  const std::string page = MarkdownPage("tool").examples({"tool a   does it", "tool b \\", "  --out c"}).written();
  EXPECT_THAT(page, HasSubstr("```sh\ntool a   # does it\ntool b \\\n  --out c\n```\n"));
  EXPECT_THAT(page, HasSubstr("<!-- not run: ")) << "the tests of the site ask for a reason";
}

TEST(MarkdownTest, EveryCommandHasAPageInMarkdownToo) {
  const std::vector<Page> pages = pages_of_locus(Form::kMarkdown), manual = pages_of_locus();
  ASSERT_EQ(pages.size(), manual.size());
  for (size_t at = 0; at < pages.size(); ++at) {
    EXPECT_EQ(pages[at].file, manual[at].file.substr(0, manual[at].file.size() - 1) + "md");
    EXPECT_THAT(pages[at].text, Not(HasSubstr("\\fB"))) << pages[at].file << " has markup of roff";
  }
  EXPECT_THAT(pages[0].text, HasSubstr("## Exit status\n"));
  EXPECT_THAT(pages[1].text, Not(HasSubstr("## Exit status\n"))) << "the page of the program has it";
}

}  // namespace
}  // namespace locus::manual
