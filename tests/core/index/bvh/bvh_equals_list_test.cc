// Trees answer as the list does, bit for bit, whatever the number of bins they were built with.
#include <gtest/gtest.h>

#include "core/index/bvh/bvh.h"
#include "tests/support/adversarial_scenes.h"
#include "tests/support/index_judge.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

template <class V>
class BvhEqualsListTest : public ::testing::Test {
 protected:
  static std::string first_difference_of_trees(const TestScene<V>& scene) {
    const auto list = make_list(scene.values);
    for (const int bins : {32, 4, 2}) {
      BvhOptions options;
      options.bins = bins;
      const absl::StatusOr<Bvh<V>> tree = Bvh<V>::build(scene.values, options);
      if (!tree.ok()) return tree.status().ToString();
      const std::string what = IndexJudge(*tree, list).difference(scene);
      if (!what.empty()) return std::to_string(bins) + " bins: " + what;
    }
    return "";
  }
};

using ValueTypes = ::testing::Types<Triangle, Object>;
TYPED_TEST_SUITE(BvhEqualsListTest, ValueTypes);

TYPED_TEST(BvhEqualsListTest, OnRandomScenes) {
  for (uint64_t seed = 0; seed < scaled_count(10'000); ++seed) {
    Random random(seed);
    const auto scene = make_scene<TypeParam>(random_scene(random), random);
    ASSERT_EQ(this->first_difference_of_trees(scene), "") << "seed " << seed;
  }
}

TYPED_TEST(BvhEqualsListTest, OnAdversarialScenes) {
  for (uint64_t seed = 0; seed < scaled_count(2'400); ++seed) {
    Random random(seed);
    const auto scene = make_scene<TypeParam>(adversarial_scene(seed, random), random);
    ASSERT_EQ(this->first_difference_of_trees(scene), "") << "seed " << seed;
  }
}

}  // namespace
}  // namespace locus::test
