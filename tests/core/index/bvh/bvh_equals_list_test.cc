// Trees and the list give bitwise equal results, for any number of bins of the builder.
#include <gtest/gtest.h>

#include "tests/support/scene_search.h"

namespace locus::test {
namespace {

template <class V>
class BvhEqualsListTest : public ::testing::Test {};

using ValueTypes = ::testing::Types<Triangle, Object>;
TYPED_TEST_SUITE(BvhEqualsListTest, ValueTypes);

TYPED_TEST(BvhEqualsListTest, OnRandomScenes) {
  EXPECT_EQ(search_all_scenes<TypeParam>(scaled_count(10'000), 0, tree_difference<TypeParam>), "");
}

TYPED_TEST(BvhEqualsListTest, OnAdversarialScenes) {
  EXPECT_EQ(search_all_scenes<TypeParam>(0, scaled_count(1'200), tree_difference<TypeParam>), "");
}

}  // namespace
}  // namespace locus::test
