// Comparison of the structures of index_structures.h with the list. Used by the random tests, which expect no
// difference, and by the tests of planted bugs, which expect a difference.
#ifndef LOCUS_TESTS_SUPPORT_STRUCTURE_COMPARISON_H_
#define LOCUS_TESTS_SUPPORT_STRUCTURE_COMPARISON_H_

#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "tests/support/index_judge.h"
#include "tests/support/index_structures.h"
#include "tests/support/plane_scenes.h"
#include "tests/support/scene_search.h"

namespace locus::test {

// Returns a violation of the limits of an index that has just been built of `count` values; empty if there is none.
template <class Index>
std::string shape_fault(const Index& index, size_t count) {
  if constexpr (requires { index.shape().nodes; }) {
    const auto shape = index.shape();
    if (count > 0 && shape.nodes >= 2 * count) return absl::StrCat(shape.nodes, " nodes for ", count, " values");
    if (count > 0 && shape.references >= 4 * count)
      return absl::StrCat(shape.references, " references to ", count, " values");
    if (shape.depth > limits::kMaxKdDepth) return absl::StrCat(shape.depth, " levels");
  }
  return "";
}

// Returns the first difference between a list and an index of the scene's values that was built at once; empty if there
// is none.
template <class Structure, class V>
std::string built_difference(const TestScene<V>& scene) {
  const auto index = Structure::make(scene.values);
  if (std::string what = shape_fault(index, scene.values.size()); !what.empty()) return scene.name + ": " + what;
  return IndexJudge(index, make_list(scene.values)).difference(scene);
}

// Returns the first difference between a list and an index that is built of the first third of the scene's values, gets
// the others one by one, and then loses every third value; empty if there is none.
template <class Structure, class V>
std::string changed_difference(const TestScene<V>& scene) {
  const auto third = scene.values.begin() + static_cast<ptrdiff_t>(scene.values.size() / 3);
  auto index = Structure::make(std::vector<V>(scene.values.begin(), third));
  ListIndex<V> list = make_list(std::vector<V>(scene.values.begin(), third));
  for (auto value = third; value != scene.values.end(); ++value) {
    index.insert(*value);
    list.insert(*value);
  }
  for (size_t i = 0; i < scene.values.size(); i += 3) {
    if (!index.contains(scene.values[i])) return "a value is missing";
    if (!index.remove(scene.values[i]) || index.remove(scene.values[i])) return "a value was not removed once";
    if (index.contains(scene.values[i])) return "a removed value is contained";
    list.remove(scene.values[i]);
  }
  if (std::string what = IndexJudge(index, list).difference(scene); !what.empty()) return "after changes, " + what;
  return "";
}

template <class Structure, class V>
std::string structure_difference(const TestScene<V>& scene) {
  if (std::string what = built_difference<Structure>(scene); !what.empty()) return what;
  if constexpr (MutableSpatialIndex<typename Structure::Index>) return changed_difference<Structure>(scene);
  return "";
}

// Returns the first difference that structure_difference() finds in scenes of both kinds; empty if there is none.
template <class Structure>
std::string search_structure_scenes(uint64_t random_count, uint64_t adversarial_count) {
  using V = typename Structure::Index::Value;
  const auto draw_random = [](uint64_t, Random& random) { return random_scene(random); };
  const std::string what = search_scenes<V>(random_count, draw_random, structure_difference<Structure, V>);
  if (!what.empty()) return what;
  return search_scenes<V>(adversarial_count, structure_scene, structure_difference<Structure, V>);
}

// Returns the first difference that search_structure_scenes() finds for any structure of the list; empty if there is
// none.
template <class... Structures>
std::string search_structures(StructureList<Structures...>, uint64_t random_count, uint64_t adversarial_count) {
  std::string what;
  const auto search = [&]<class Structure>(Structure) {
    if (what.empty()) what = search_structure_scenes<Structure>(random_count, adversarial_count);
  };
  (search(Structures()), ...);
  return what;
}

// Returns a fault of a short ray in a kd tree of many points on its line: the ray must open only the nodes that it
// reaches. Empty if there is none.
inline std::string short_ray_fault() {
  std::vector<Object> points;
  for (uint32_t i = 0; i < 1'000; ++i) {
    points.emplace_back().id = i + 1;
    points.back().shape.position = {double(i), 0, 0};
  }
  const auto tree = KdTreeInLeaves<Object, KdSplit::kMedian>::make(points);
  Object hit;
  double distance = 1;
  Work work;
  first_ray(tree, ObjectRay(Rayd{{10.5, 0, 0}, {1, 0, 0}}), hit, distance, &work);
  return work.nodes <= 2 * tree.shape().depth ? "" : absl::StrCat("a short ray opened ", work.nodes, " nodes");
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_STRUCTURE_COMPARISON_H_
