#include "deploy/manual/roff.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace locus::manual {
namespace {

TEST(RoffTest, NothingInATextIsACommandOrAnEscape) {
  EXPECT_EQ(escaped(".so \\fB"), "\\&.so \\efB");
  EXPECT_EQ(escaped("a.b\n'c"), "a.b\n\\&\\(aqc");
}

TEST(RoffTest, SpecialCharactersArePrintedAsTyped) {
  EXPECT_EQ(escaped("--mode `x` \"y\" 'z' ^ ~"), "\\-\\-mode \\(gax\\(ga \\(dqy\\(dq \\(aqz\\(aq \\(ha \\(ti");
}

TEST(RoffTest, AnEmptyLineBeginsAParagraphAndOnlyBetweenTexts) {
  EXPECT_EQ(RoffPage("T", "1", "s").text("a\nb\n\nc\n\n").roff(), RoffPage("T", "1", "s").roff() + "a\nb\n.PP\nc\n");
}

TEST(RoffTest, ALongListWithoutBlanksMayBreakAfterItsCommas) {
  EXPECT_THAT(RoffPage("T", "1", "s").text("at 1,2 give center_x,center_y,center_z,half_x").roff(),
              ::testing::HasSubstr("at 1,2 give center_x,\\:center_y,\\:center_z,\\:half_x\n"));
}

TEST(RoffTest, LiteralLinesKeepTheirEnds) {
  EXPECT_THAT(RoffPage("T", "1", "s").literal({"a  b", ".c"}).roff(), ::testing::HasSubstr(".nf\na  b\n\\&.c\n.fi\n"));
}

}  // namespace
}  // namespace locus::manual
