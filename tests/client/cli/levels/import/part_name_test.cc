#include "client/cli/levels/import/part_name.h"

#include <gtest/gtest.h>

#include <string>

#include "client/cli/levels/import/import_limits.h"

namespace locus::cli {
namespace {

TEST(PartNameTest, PlainNamesStay) { EXPECT_EQ(clean_part_name("textures/base wall-01"), "textures/base wall-01"); }

TEST(PartNameTest, ValidUtf8Stays) {
  for (const char* name : {"T\xC3\xBCr", "\xE5\xA3\x81", "\xF0\x9F\x8F\xA0", "\xED\x9F\xBF", "\xF4\x8F\xBF\xBF"}) {
    EXPECT_EQ(clean_part_name(name), name);
  }
}

TEST(PartNameTest, BrokenUtf8LosesItsHighBytes) {
  EXPECT_EQ(clean_part_name("T\xFCr"), "T_r");               // Latin-1
  EXPECT_EQ(clean_part_name("a\xC0\x80"), "a__");            // overlong
  EXPECT_EQ(clean_part_name("a\xE0\x80\x80"), "a___");       // overlong
  EXPECT_EQ(clean_part_name("a\xED\xA0\x80"), "a___");       // surrogate
  EXPECT_EQ(clean_part_name("a\xF4\x90\x80\x80"), "a____");  // beyond U+10FFFF
  EXPECT_EQ(clean_part_name("a\xE5\xA3"), "a__");            // cut short
  EXPECT_EQ(clean_part_name("a\xF0\x9F\x8F"), "a___");       // cut short
  EXPECT_EQ(clean_part_name("\x80z"), "_z");                 // starts in the middle
}

TEST(PartNameTest, ControlCharactersAreReplaced) { EXPECT_EQ(clean_part_name("a\nb\x1B[31m\x7F"), "a_b_[31m_"); }

TEST(PartNameTest, LongNamesAreTruncatedAtACharacterBoundary) {
  const std::string ascii(kMaxPartNameBytes - 1, 'a');
  EXPECT_EQ(clean_part_name(ascii + "bcd"), ascii + "b");
  EXPECT_EQ(clean_part_name(ascii + "\xC3\xBC"), ascii);
}

}  // namespace
}  // namespace locus::cli
