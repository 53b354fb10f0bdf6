#include "core/index/bvh/kernels/dispatch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace locus {
namespace {

using ::testing::HasSubstr;

class DispatchTest : public ::testing::Test {
 protected:
  void TearDown() override { ASSERT_TRUE(use_instruction_set("").ok()); }
};

TEST_F(DispatchTest, TheWidestServesUnlessOneIsNamed) {
  EXPECT_EQ(instruction_set(), instruction_sets().front());
  EXPECT_EQ(instruction_sets().back(), kPortable);
}

TEST_F(DispatchTest, EachCanBeNamed) {
  for (const std::string& name : instruction_sets()) {
    ASSERT_TRUE(use_instruction_set(name).ok()) << name;
    EXPECT_EQ(instruction_set(), name);
    EXPECT_EQ(active_ray_kernels() == nullptr, name == kPortable);
  }
}

TEST_F(DispatchTest, AnUnknownOneIsRefusedWithThoseThereAreAndChangesNothing) {
  const std::string before(instruction_set());
  const absl::Status status = use_instruction_set("mmx");
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("'mmx'"));
  EXPECT_THAT(std::string(status.message()), HasSubstr(kPortable));
  EXPECT_EQ(instruction_set(), before);
}

}  // namespace
}  // namespace locus
