// Comparisons of BspTree with the list, with every option, and of the order of its cells with geometry. Each returns
// the first difference; an empty string if there is none. Used by tests of the tree and of planted bugs.
#ifndef LOCUS_TESTS_SUPPORT_BSP_TRIALS_H_
#define LOCUS_TESTS_SUPPORT_BSP_TRIALS_H_

#include <cmath>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "core/index/bsp_tree/bsp_tree.h"
#include "tests/support/generated_meshes.h"
#include "tests/support/scene_search.h"

namespace locus::test {

// Every treatment of cut values with every choice of planes, with large and small leaves and a low limit of depth.
inline constexpr BspTreeOptions kBspTrials[] = {
    {CutValues::kInLeaves, BspPlanes::kBest, 8, limits::kMaxBspDepth},
    {CutValues::kInLeaves, BspPlanes::kValues, 1, limits::kMaxBspDepth},
    {CutValues::kInLeaves, BspPlanes::kAxes, 3, 5},
    {CutValues::kAtNode, BspPlanes::kBest, 2, limits::kMaxBspDepth},
    {CutValues::kAtNode, BspPlanes::kValues, 8, 5},
    {CutValues::kAtNode, BspPlanes::kAxes, 1, limits::kMaxBspDepth},
};

inline std::string label(const BspTreeOptions& options) {
  return std::string(options.cut == CutValues::kAtNode ? "at node" : "in leaves") + ", planes " +
         std::to_string(static_cast<int>(options.planes)) + ", leaves of " + std::to_string(options.leaf_size) + ": ";
}

// Returns how the shape of a tree that was just built exceed its limits.
inline std::string excess(const BspTreeShape& now, size_t size, const BspTreeOptions& options) {
  if (now.nodes != 1 && now.nodes >= 2 * size) return std::to_string(now.nodes) + " nodes";
  if (size > 0 && now.references >= 4 * size) return std::to_string(now.references) + " references";
  if (options.cut == CutValues::kAtNode && now.references != size) return "a value is listed twice";
  return now.depth > options.max_depth ? "depth " + std::to_string(now.depth) : "";
}

// Compares a tree that was built of all values with the options.
template <Primitive V>
std::string built_bsp_difference(const TestScene<V>& scene, const BspTreeOptions& options) {
  const BspTree<V> tree = BspTree<V>::build(scene.values, options);
  std::string what = excess(tree.shape(), tree.size(), options);
  if (what.empty()) what = first_difference(tree, scene);
  return what.empty() ? "" : label(options) + what;
}

// Compares trees that were built with each of the options.
template <Primitive V>
std::string bsp_difference(const TestScene<V>& scene) {
  for (const BspTreeOptions& options : kBspTrials)
    if (const std::string what = built_bsp_difference(scene, options); !what.empty()) return what;
  return "";
}

// Compares two trees, one with each treatment of cut values; the number of values selects the other options.
template <Primitive V>
std::string bsp_treatment_difference(const TestScene<V>& scene) {
  constexpr size_t kHalf = std::size(kBspTrials) / 2;
  static_assert(kBspTrials[kHalf - 1].cut != kBspTrials[kHalf].cut);
  const size_t turn = scene.values.size() % kHalf;
  const std::string what = built_bsp_difference(scene, kBspTrials[turn]);
  return what.empty() ? built_bsp_difference(scene, kBspTrials[kHalf + turn]) : what;
}

// Compares trees that were built of a third of the values; the other values were inserted, all but every fourth value
// were removed, and most of these were inserted again.
template <Primitive V>
std::string changed_bsp_difference(const TestScene<V>& scene) {
  const size_t third = scene.values.size() / 3;
  for (const BspTreeOptions& options : kBspTrials) {
    const std::vector<V> first(scene.values.begin(), scene.values.begin() + static_cast<std::ptrdiff_t>(third));
    BspTree<V> tree = BspTree<V>::build(first, options);
    auto list = make_list(first);
    const auto insert = [&](const V& value) {
      tree.insert(value);
      list.insert(value);
    };
    for (size_t i = third; i < scene.values.size(); ++i) insert(scene.values[i]);
    for (size_t i = 0; i < scene.values.size(); ++i)
      if (i % 4 != 0 && tree.remove(scene.values[i]) != list.remove(scene.values[i])) return "remove() says otherwise";
    if (const std::string what = IndexJudge(tree, list).difference(scene); !what.empty())
      return label(options) + "after removals, " + what;
    for (size_t i = 0; i < scene.values.size(); ++i)
      if (i % 4 > 1) insert(scene.values[i]);
    if (const std::string what = IndexJudge(tree, list).difference(scene); !what.empty())
      return label(options) + "after changes, " + what;
  }
  return "";
}

// Trees of triangles whose cells are tested: a city, whose planes are those of walls, and loose triangles, whose planes
// are oblique.
inline std::vector<BspTree<Triangle>> trees_of_triangles() {
  std::vector<Triangle> loose;
  Random random(12);
  for (int i = 0; i < 400; ++i) {
    const Vec3d center = random.vector(20);
    const auto corner = [&] { return to_float(center + random.vector(1)); };
    loose.push_back({corner(), corner(), corner()});
  }
  number_in_order(loose);
  std::vector<BspTree<Triangle>> trees;
  for (const BspTreeOptions& options : kBspTrials) {
    trees.push_back(BspTree<Triangle>::build(box_city(4, 1), options));
    trees.push_back(BspTree<Triangle>::build(loose, options));
  }
  return trees;
}

template <class Tree>
std::vector<CellNumber> leaves_from(const Tree& tree, const Vec3d& eye) {
  std::vector<CellNumber> leaves;
  tree.visit_front_to_back(eye, [&leaves](CellNumber leaf) {
    leaves.push_back(leaf);
    return true;
  });
  return leaves;
}

// Verifies the order of leaves from random eyes: along rays from the eye, the leaves in front of which the ray is come
// in the order of visit_front_to_back().
inline std::string bsp_order_difference() {
  Random random(3);
  for (const BspTree<Triangle>& tree : trees_of_triangles()) {
    for (int turn = 0; turn < 20; ++turn) {
      const Vec3d eye = random.vector(40);
      std::map<CellNumber, size_t> order;
      for (const CellNumber leaf : leaves_from(tree, eye)) order.emplace(leaf, order.size());
      for (int i = 0; i < 20; ++i) {
        const Rayd ray = {eye, random.unit_vector(), 100};
        size_t last = 0;
        bool back = false;
        tree.leaves_on_ray(ray, [&](CellNumber leaf, double, double) {
          back |= order.at(leaf) < last;
          last = order.at(leaf);
          return true;
        });
        if (back) return "the order goes back along a ray";
      }
    }
  }
  return "";
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_BSP_TRIALS_H_
