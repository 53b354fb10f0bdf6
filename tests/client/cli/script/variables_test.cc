#include "client/cli/script/variables.h"

#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"
#include "client/cli/script/script_limits.h"

namespace locus::cli {
namespace {

TEST(VariablesTest, TheLastValueStays) {
  Variables variables;
  EXPECT_EQ(variables.find("a"), nullptr);
  ASSERT_TRUE(variables.set("a", Value::of(Json(1))).ok());
  ASSERT_TRUE(variables.set("a", Value::of(Json(2))).ok());
  EXPECT_EQ(shown(*variables.find("a")), "2");
}

TEST(VariablesTest, NamesAreWords) {
  Variables variables;
  for (const char* name : {"", "1a", "a-b", "a.b", "a b", "$a"}) {
    EXPECT_FALSE(variables.set(name, Value::of(Json(1))).ok()) << name;
  }
  EXPECT_TRUE(variables.set("_a1", Value::of(Json(1))).ok());
}

TEST(VariablesTest, TheirNumberIsLimited) {
  Variables variables;
  for (size_t i = 0; i < kMaxVariables; ++i) ASSERT_TRUE(variables.set(absl::StrCat("v", i), {}).ok());
  EXPECT_TRUE(absl::IsResourceExhausted(variables.set("more", {})));
  EXPECT_TRUE(variables.set("v0", {}).ok()) << "it is there already";
}

}  // namespace
}  // namespace locus::cli
