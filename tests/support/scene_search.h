// Search of many seeded scenes for a scene on which a comparison finds a difference. The random tests expect no
// difference; the tests of planted bugs expect a difference.
#ifndef LOCUS_TESTS_SUPPORT_SCENE_SEARCH_H_
#define LOCUS_TESTS_SUPPORT_SCENE_SEARCH_H_

#include <string>

#include "core/index/bvh/bvh.h"
#include "core/index/bvh/triangle_bvh.h"
#include "tests/support/adversarial_scenes.h"
#include "tests/support/index_judge.h"
#include "tests/support/test_scale.h"

namespace locus::test {

// Returns the first difference found in the scenes of seeds 0 to count - 1, with its seed; empty if there is none.
// `draw` generates the sketch of a seed; `difference` returns the first difference in one TestScene<V>.
template <Primitive V, class Draw, class Difference>
std::string search_scenes(uint64_t count, const Draw& draw, const Difference& difference) {
  for (uint64_t seed = 0; seed < count; ++seed) {
    Random random(seed);
    const TestScene<V> scene = make_scene<V>(draw(seed, random), random);
    if (const std::string what = difference(scene); !what.empty()) return "seed " + std::to_string(seed) + ", " + what;
  }
  return "";
}

// Returns the first difference found in ordinary scenes or, if these have none, in the adversarial families; empty if
// there is none.
template <Primitive V, class Difference>
std::string search_all_scenes(uint64_t random_count, uint64_t adversarial_count, const Difference& difference) {
  const auto draw_random = [](uint64_t, Random& random) { return random_scene(random); };
  const std::string what = search_scenes<V>(random_count, draw_random, difference);
  return what.empty() ? search_scenes<V>(adversarial_count, adversarial_scene, difference) : what;
}

// Returns the first difference between a list of the values and trees built with 32, 4 and 2 bins; empty if there is
// none.
template <Primitive V>
std::string tree_difference(const TestScene<V>& scene) {
  const auto list = make_list(scene.values);
  for (const int bins : {32, 4, 2}) {
    BvhOptions options;
    options.bins = bins;
    const absl::StatusOr<Bvh<V>> tree = Bvh<V>::build(scene.values, options);
    if (!tree.ok()) return tree.status().ToString();
    const std::string what = IndexJudge(*tree, list).difference(scene);
    if (!what.empty()) return std::to_string(bins) + " bins, " + what;
  }
  return "";
}

// Returns the first difference between a list of the triangles and a TriangleBvh with the default number of bins; empty
// if there is none.
inline std::string triangle_tree_difference(const TestScene<Triangle>& scene) {
  const absl::StatusOr<TriangleBvh> tree = TriangleBvh::build(scene.values);
  return tree.ok() ? first_difference(*tree, scene) : tree.status().ToString();
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_SCENE_SEARCH_H_
