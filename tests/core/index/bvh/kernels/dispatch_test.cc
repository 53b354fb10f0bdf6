#include "core/index/bvh/kernels/dispatch.h"

#include <gtest/gtest.h>

namespace locus {
namespace {

TEST(DispatchTest, KernelsAreThoseOfTheInstructionSetInUse) {
  for (const std::string& name : instruction_sets()) {
    ASSERT_TRUE(use_instruction_set(name).ok()) << name;
    ASSERT_EQ(active_ray_kernels() == nullptr, name == kPortable);
    ASSERT_EQ(active_region_kernels() == nullptr, name == kPortable);
    ASSERT_EQ(active_nearest_kernels() == nullptr, name == kPortable);
    ASSERT_EQ(active_crossing_kernels() == nullptr, name == kPortable);
    if (name == kPortable) continue;
    EXPECT_EQ(active_ray_kernels()->name, name);
    EXPECT_EQ(active_region_kernels()->name, name);
    EXPECT_EQ(active_nearest_kernels()->name, name);
    EXPECT_EQ(active_crossing_kernels()->name, name);
  }
  ASSERT_TRUE(use_instruction_set("").ok());
}

}  // namespace
}  // namespace locus
