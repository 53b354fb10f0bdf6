// Comparison of octrees with the list, for all sets of axes and both places of cut values.
#ifndef LOCUS_TESTS_SUPPORT_OCTREE_COMPARISON_H_
#define LOCUS_TESTS_SUPPORT_OCTREE_COMPARISON_H_

#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/index/octree/octree.h"
#include "tests/support/changed_index.h"
#include "tests/support/grid_scenes.h"
#include "tests/support/scene_search.h"

namespace locus::test {

// Returns a violation of the limits of a tree that has just been built; empty if there is none.
template <class V>
std::string octree_shape_fault(const Octree<V>& tree, uint32_t max_depth) {
  const PlaneTreeShape shape = tree.shape();
  if (tree.size() > 0 && shape.nodes >= 2 * tree.size()) return absl::StrCat(shape.nodes, " nodes");
  if (tree.size() > 0 && shape.references >= 4 * tree.size()) return absl::StrCat(shape.references, " references");
  if (shape.depth > max_depth) return absl::StrCat(shape.depth, " levels");
  return "";
}

inline OctreeOptions octree_options(uint32_t axes, CutValues cut) {
  OctreeOptions options;
  options.axes = {.x = (axes & 1) != 0, .y = (axes & 2) != 0, .z = (axes & 4) != 0};
  options.cut = cut;
  options.leaf_size = 2;  // the scenes of tests are small
  return options;
}

// Returns the first difference between a list and trees of the scene's values: one that is built at once, and one that
// is built of the first third of the values and then changed; empty if there is none.
template <class V>
std::string octree_difference(const TestScene<V>& scene, const OctreeOptions& options) {
  const auto tree = Octree<V>::build(scene.values, options);
  if (std::string what = octree_shape_fault(tree, options.max_depth); !what.empty()) return scene.name + ": " + what;
  if (std::string what = first_difference(tree, scene); !what.empty()) return what;
  const auto third = scene.values.begin() + static_cast<ptrdiff_t>(scene.values.size() / 3);
  const std::vector<V> first(scene.values.begin(), third), others(third, scene.values.end());
  auto changed = Octree<V>::build(first, options);
  auto list = make_list(first);
  return changed_difference(changed, list, others, scene);
}

// Compares trees with both places of cut values, divided on all axes and on the axes that the number of values selects,
// so that many scenes cover all sets of axes.
template <class V>
std::string octrees_difference(const TestScene<V>& scene) {
  for (const uint32_t axes : {7u, 1 + static_cast<uint32_t>(scene.values.size()) % 6}) {
    for (const CutValues cut : {CutValues::kInLeaves, CutValues::kAtNode}) {
      if (std::string what = octree_difference(scene, octree_options(axes, cut)); !what.empty())
        return absl::StrCat("axes ", axes, ", cut values ", static_cast<int>(cut), ", ", what);
    }
  }
  return "";
}

inline SceneSketch octree_scene(uint64_t seed, Random& random) {
  return seed % 2 == 0 ? adversarial_scene(seed / 2, random) : grid_scene(seed / 2, random);
}

// Returns a message if a short ray opens about as many nodes of a tree as a long one; empty if it opens far fewer.
inline std::string octree_short_ray_fault() {
  std::vector<Object> boxes;
  for (int i = 0; i < 4096; ++i) {
    const Vec3d center = {double(i % 16), double(i / 16 % 16), double(i / 256)};
    boxes.push_back(value_filling<Object>(center, {0.1, 0.1, 0.1}, static_cast<uint32_t>(i + 1)));
  }
  const auto tree = Octree<Object>::build(boxes);
  const ObjectRay ray(Rayd{{0.5, 0.5, 0.5}, {1, 0.01, 0.02}});
  Work short_work, long_work;
  any_ray(tree, ray, 1, &short_work);
  any_ray(tree, ray, std::numeric_limits<double>::infinity(), &long_work);
  if (short_work.nodes * 2 < long_work.nodes) return "";
  return absl::StrCat("a short ray opens ", short_work.nodes, " nodes, a long one ", long_work.nodes);
}

inline std::string search_octrees(uint64_t random_count, uint64_t adversarial_count) {
  const auto draw_random = [](uint64_t, Random& random) { return random_scene(random); };
  std::string what = search_scenes<Triangle>(random_count, draw_random, octrees_difference<Triangle>);
  if (what.empty()) what = search_scenes<Object>(random_count, draw_random, octrees_difference<Object>);
  if (what.empty()) what = search_scenes<Triangle>(adversarial_count, octree_scene, octrees_difference<Triangle>);
  if (what.empty()) what = search_scenes<Object>(adversarial_count, octree_scene, octrees_difference<Object>);
  return what;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_OCTREE_COMPARISON_H_
