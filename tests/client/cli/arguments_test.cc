#include "client/cli/arguments.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <sstream>

namespace locus::cli {
namespace {

using ::testing::ElementsAre;

template <class T>
std::optional<T> parsed(const std::string& text) {
  std::istringstream in(text);
  T value;
  in >> value;
  if (in.fail() || in.rdbuf()->in_avail() > 0) return std::nullopt;
  return value;
}

TEST(ArgumentsTest, TriplesAreThreeNumbersWithCommas) {
  const std::optional<Triple> triple = parsed<Triple>("-1,2.5,3e3");
  ASSERT_TRUE(triple.has_value());
  EXPECT_THAT(doubles_of({*triple}), ElementsAre(-1, 2.5, 3000));
  for (const char* bad : {"", "1,2", "1,2,3,4", "1,2,x", "1,,2", "1;2;3"}) {
    EXPECT_FALSE(parsed<Triple>(bad).has_value()) << bad;
  }
}

TEST(ArgumentsTest, QuaternionsAreFourNumbers) {
  EXPECT_THAT(floats_of({*parsed<Quaternion>("0,0,0.5,1")}), ElementsAre(0, 0, 0.5f, 1));
  EXPECT_FALSE(parsed<Quaternion>("0,0,1").has_value());
}

TEST(ArgumentsTest, NumbersTake64BitsInDecimalOrHexadecimal) {
  EXPECT_EQ(parsed<Number64>("18446744073709551615")->value, 0xFFFFFFFFFFFFFFFFull);
  EXPECT_EQ(parsed<Number64>("0xff")->value, 255u);
  for (const char* bad : {"-1", "18446744073709551616", "1.5", "x", "0x"}) {
    EXPECT_FALSE(parsed<Number64>(bad).has_value()) << bad;
  }
}

TEST(ArgumentsTest, MasksMustFit32Bits) {
  EXPECT_EQ(fits_32_bits()("4294967295"), "");
  EXPECT_NE(fits_32_bits()("4294967296"), "");
  EXPECT_NE(fits_32_bits()("all"), "");
}

}  // namespace
}  // namespace locus::cli
