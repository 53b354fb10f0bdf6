// SphereTree and the list give bitwise equal results.
#include <gtest/gtest.h>

#include "tests/support/sphere_tree_trials.h"

namespace locus::test {
namespace {

template <class V>
class SphereTreeEqualsListTest : public ::testing::Test {};

using ValueTypes = ::testing::Types<Triangle, Object>;
TYPED_TEST_SUITE(SphereTreeEqualsListTest, ValueTypes);

TYPED_TEST(SphereTreeEqualsListTest, OnRandomScenes) {
  EXPECT_EQ(search_all_scenes<TypeParam>(scaled_count(10'000), 0, sphere_tree_difference<TypeParam>), "");
}

TYPED_TEST(SphereTreeEqualsListTest, OnAdversarialScenes) {
  EXPECT_EQ(search_all_scenes<TypeParam>(0, scaled_count(1'200), sphere_tree_difference<TypeParam>), "");
}

}  // namespace
}  // namespace locus::test
