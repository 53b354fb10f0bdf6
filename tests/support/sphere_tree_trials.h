// Comparison of SphereTree with the list, used by tests of the tree and of planted bugs.
#ifndef LOCUS_TESTS_SUPPORT_SPHERE_TREE_TRIALS_H_
#define LOCUS_TESTS_SUPPORT_SPHERE_TREE_TRIALS_H_

#include <string>

#include "core/index/sphere_tree/sphere_tree.h"
#include "tests/support/scene_search.h"

namespace locus::test {

// Returns the first difference between a tree of the scene's values and the list; empty if there is none.
template <Primitive V>
std::string sphere_tree_difference(const TestScene<V>& scene) {
  const absl::StatusOr<SphereTree<V>> tree = SphereTree<V>::build(scene.values);
  if (!tree.ok()) return tree.status().ToString();
  if (tree->size() > 0 && tree->shape().nodes >= 2 * tree->size()) return "too many nodes";
  return first_difference(*tree, scene);
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_SPHERE_TREE_TRIALS_H_
