// BspTree and the list give bitwise equal results, for every option, after builds and after changes.
#include <gtest/gtest.h>

#include "tests/support/bsp_trials.h"

namespace locus::test {
namespace {

template <class V>
class BspTreeEqualsListTest : public ::testing::Test {};

using ValueTypes = ::testing::Types<Triangle, Object>;
TYPED_TEST_SUITE(BspTreeEqualsListTest, ValueTypes);

TYPED_TEST(BspTreeEqualsListTest, OnRandomScenes) {
  EXPECT_EQ(search_all_scenes<TypeParam>(scaled_count(10'000), 0, bsp_treatment_difference<TypeParam>), "");
}

TYPED_TEST(BspTreeEqualsListTest, OnAdversarialScenes) {
  EXPECT_EQ(search_all_scenes<TypeParam>(0, scaled_count(1'200), bsp_difference<TypeParam>), "");
}

TYPED_TEST(BspTreeEqualsListTest, AfterChanges) {
  EXPECT_EQ(search_all_scenes<TypeParam>(scaled_count(500), scaled_count(500), changed_bsp_difference<TypeParam>), "");
}

}  // namespace
}  // namespace locus::test
