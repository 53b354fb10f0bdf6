#include "client/cli/rows/bulk/row_builder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace locus::cli {
namespace {

using ::testing::ElementsAre;

const RowSchema& schema_of_all_kinds() {
  static const auto& schema =
      *new RowSchema{{.name = "at", .kind = FieldKind::kCoordinate, .parts = "xyz", .required = true},
                     {.name = "max_t", .kind = FieldKind::kDistance},
                     {.name = "id", .kind = FieldKind::kId},
                     {.name = "mask", .kind = FieldKind::kBits},
                     {.name = "radius", .kind = FieldKind::kFloat},
                     {.name = "shape", .kind = FieldKind::kWord, .words = {"ball", "box"}}};
  return schema;
}

constexpr size_t kMaxT = 1, kId = 2, kMask = 3, kRadius = 4, kShape = 5;

std::string refusal(size_t field, absl::string_view text) {
  RowBuilder builder(schema_of_all_kinds());
  builder.start();
  const Slot slot = schema_of_all_kinds()[field].parts.empty() ? Slot{field} : Slot{field, 1};
  return std::string(builder.put_text(slot, text).message());
}

TEST(RowBuilderTest, TextIsConvertedToTheKindOfItsField) {
  RowBuilder builder(schema_of_all_kinds());
  RowBatch batch = builder.empty_batch(0);
  builder.start();
  for (const size_t part : {0u, 1u, 2u}) ASSERT_TRUE(builder.put_text({0, part}, "-1e9").ok());
  ASSERT_TRUE(builder.put_text({kMaxT}, "inf").ok());
  ASSERT_TRUE(builder.put_text({kId}, "18446744073709551615").ok());
  ASSERT_TRUE(builder.put_text({kMask}, "0xFFFFFFFF").ok());
  ASSERT_TRUE(builder.put_text({kRadius}, "+.5").ok());
  ASSERT_TRUE(builder.put_text({kShape}, "box").ok());
  ASSERT_TRUE(builder.finish(9, batch).ok());
  EXPECT_THAT(batch.columns[0].numbers, ElementsAre(-1e9, -1e9, -1e9));
  EXPECT_THAT(batch.columns[kMaxT].numbers, ElementsAre(std::numeric_limits<double>::infinity()));
  EXPECT_THAT(batch.columns[kId].integers, ElementsAre(18446744073709551615ull));
  EXPECT_THAT(batch.columns[kMask].integers, ElementsAre(4294967295u));
  EXPECT_THAT(batch.columns[kRadius].numbers, ElementsAre(0.5));
  EXPECT_THAT(batch.columns[kShape].integers, ElementsAre(1));
  EXPECT_THAT(batch.lines, ElementsAre(9));
}

TEST(RowBuilderTest, TextThatIsNotANumberIsReportedWithItsColumn) {
  EXPECT_EQ(refusal(0, "abc"), "at.y: 'abc' is no number");
  for (const char* text : {"1,5", "1 2", "0x10", "1e", "--1", "+-1", "+", "1.2.3", "١", "1e400", "1e-400"}) {
    EXPECT_NE(refusal(kRadius, text).find("is no number"), std::string::npos) << text;
  }
}

TEST(RowBuilderTest, MessagesEscapeUnprintableBytesAndTruncateLongText) {
  EXPECT_EQ(refusal(kRadius, absl::string_view("1\0\n", 3)), "radius: '1\\000\\n' is no number");
  EXPECT_EQ(refusal(kRadius, std::string(1000, 'x')), "radius: '" + std::string(40, 'x') + "...' is no number");
}

TEST(RowBuilderTest, NumbersOutOfRangeAreRefusedByKind) {
  EXPECT_EQ(refusal(0, "nan"), "at.y: nan is not finite");
  EXPECT_EQ(refusal(0, "-inf"), "at.y: -inf is not finite");
  EXPECT_EQ(refusal(0, "1e308"), "at.y: 1e+308 is beyond 1e+09");
  EXPECT_EQ(refusal(kRadius, "1e308"), "radius: 1e+308 is more than a float holds");
  EXPECT_EQ(refusal(kMaxT, "-1"), "max_t: -1 is not 0 or more");
  EXPECT_EQ(refusal(kMaxT, "nan"), "max_t: nan is not 0 or more");
  EXPECT_EQ(refusal(kMask, "4294967296"), "mask: 4294967296 is beyond 4294967295");
  EXPECT_EQ(refusal(kShape, "cone"), "shape: 'cone' is none of ball, box");
}

TEST(RowBuilderTest, IdsMustBeExactIntegers) {
  for (const char* text : {"-1", "1.0", "1e3", "18446744073709551616", "0x", "0x1G", ""}) {
    EXPECT_NE(refusal(kId, text).find("is no whole number from 0 to 18446744073709551615"), std::string::npos) << text;
  }
  RowBuilder builder(schema_of_all_kinds());
  builder.start();
  EXPECT_FALSE(builder.put_number({kId}, 7.0).ok()) << "a float may have lost digits";
}

TEST(RowBuilderTest, AnIncompleteRowIsNotAppended) {
  RowBuilder builder(schema_of_all_kinds());
  RowBatch batch = builder.empty_batch(0);
  builder.start();
  EXPECT_EQ(builder.finish(1, batch).message(), "at: is missing");
  ASSERT_TRUE(builder.put_text({0, 0}, "1").ok());
  EXPECT_EQ(builder.finish(1, batch).message(), "at.y: is missing, but other parts are given");
  EXPECT_EQ(builder.put_text({0, 0}, "1").message(), "at.x: is given twice");
  EXPECT_EQ(batch.rows(), 0u);
  EXPECT_TRUE(batch.columns[0].numbers.empty());
}

TEST(RowBuilderTest, MissingValuesAreMarkedAsNotGiven) {
  RowBuilder builder(schema_of_all_kinds());
  RowBatch batch = builder.empty_batch(0);
  for (const bool with_radius : {true, false}) {
    builder.start();
    for (const size_t part : {0u, 1u, 2u}) ASSERT_TRUE(builder.put_number({0, part}, 1).ok());
    if (with_radius) {
      ASSERT_TRUE(builder.put_number({kRadius}, 2).ok());
    }
    ASSERT_TRUE(builder.finish(1, batch).ok());
  }
  EXPECT_THAT(batch.columns[kRadius].given, ElementsAre(1, 0));
  EXPECT_THAT(batch.columns[kRadius].numbers, ElementsAre(2, 0));
  EXPECT_TRUE(batch.columns[kRadius].any());
  EXPECT_FALSE(batch.columns[kRadius].all());
  EXPECT_FALSE(batch.columns[kId].any());
}

}  // namespace
}  // namespace locus::cli
