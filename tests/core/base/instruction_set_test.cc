#include "core/base/instruction_set.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace locus {
namespace {

using ::testing::HasSubstr;

class InstructionSetTest : public ::testing::Test {
 protected:
  void TearDown() override { ASSERT_TRUE(use_instruction_set("").ok()); }
};

TEST_F(InstructionSetTest, TheWidestSetIsTheDefault) {
  EXPECT_EQ(instruction_set(), instruction_sets().front());
  EXPECT_EQ(instruction_sets().back(), kPortable);
}

TEST_F(InstructionSetTest, EachSupportedSetCanBeSelected) {
  for (const std::string& name : instruction_sets()) {
    ASSERT_TRUE(use_instruction_set(name).ok()) << name;
    EXPECT_EQ(instruction_set(), name);
  }
}

TEST_F(InstructionSetTest, AnUnknownSetIsRefusedWithTheSupportedOnesAndChangesNothing) {
  const std::string before(instruction_set());
  const absl::Status status = use_instruction_set("mmx");
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("'mmx'"));
  EXPECT_THAT(std::string(status.message()), HasSubstr(kPortable));
  EXPECT_EQ(instruction_set(), before);
}

}  // namespace
}  // namespace locus
