#include "client/cli/rows/bulk/row_schema.h"

#include <gtest/gtest.h>

namespace locus::cli {
namespace {

RowSchema schema() {
  return {{.name = "at", .parts = "xyz", .aliases = {"position"}},
          {.name = "max_t"},
          {.name = "id", .kind = FieldKind::kId}};
}

TEST(RowSchemaTest, AVectorIsFoundByItsNameAndByPart) {
  EXPECT_EQ(find_slot(schema(), "at")->part, std::nullopt);
  EXPECT_EQ(find_slot(schema(), "at.z")->part, 2u);
  EXPECT_EQ(find_slot(schema(), "position.y")->part, 1u);
  EXPECT_EQ(find_slot(schema(), "position.y")->field, 0u);
}

TEST(RowSchemaTest, DashesAndUnderscoresAreEquivalent) {
  EXPECT_EQ(find_slot(schema(), "max-t")->field, 1u);
  EXPECT_EQ(find_slot(schema(), "max_t")->field, 1u);
}

TEST(RowSchemaTest, UnknownNamesAreNotFound) {
  for (const char* name : {"", ".", ".x", "at.", "at.w", "at.xy", "id.x", "AT", "at ", "ids", "at.x.y"}) {
    EXPECT_FALSE(find_slot(schema(), name).has_value()) << name;
  }
}

TEST(RowSchemaTest, TheKnownColumnsAreListedByPart) {
  EXPECT_EQ(known_columns(schema()), "at.x, at.y, at.z, max_t, id");
}

}  // namespace
}  // namespace locus::cli
