// Comparison with the list of an index that is changed value by value after its build. Used by the tests of single
// structures and by the tests of planted bugs.
#ifndef LOCUS_TESTS_SUPPORT_CHANGED_INDEX_H_
#define LOCUS_TESTS_SUPPORT_CHANGED_INDEX_H_

#include <concepts>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/index_judge.h"

namespace locus::test {

// Returns a value with the bounds center - half to center + half, if that is possible for its type.
template <class V>
V value_filling(Vec3d center, Vec3d half, uint32_t id) {
  if constexpr (std::same_as<V, Triangle>) {
    const Vec3f low = to_float(center - half), high = to_float(center + half);
    return {low, high, {low.x, high.y, low.z}, id};
  } else {
    V object;
    object.id = id;
    object.shape.kind = half == Vec3d{} ? ShapeKind::kPoint : ShapeKind::kBox;
    object.shape.position = center;
    object.shape.size = to_float(half);
    return object;
  }
}

// Inserts the values one by one into an index and a list with the same values, then removes every third value. Returns
// the first difference of the two; empty if there is none.
template <MutableSpatialIndex Index>
std::string changed_difference(Index& index, ListIndex<typename Index::Value>& list,
                               const std::vector<typename Index::Value>& values,
                               const TestScene<typename Index::Value>& queries) {
  for (const auto& value : values) {
    index.insert(value);
    list.insert(value);
  }
  for (size_t i = 0; i < values.size(); i += 3) {
    if (!index.contains(values[i])) return "a value is missing";
    if (!index.remove(values[i]) || index.remove(values[i])) return "a value was not removed once";
    if (index.contains(values[i])) return "a removed value is contained";
    list.remove(values[i]);
  }
  const std::string what = IndexJudge(index, list).difference(queries);
  return what.empty() ? "" : "after changes, " + what;
}

// Makes `changes` random inserts and removes in an index and in a list, in space that grows. Returns the first
// difference of the two over the queries of the scene; empty if there is none.
template <MutableSpatialIndex Index>
std::string drift_difference(Index& index, uint64_t changes, const TestScene<typename Index::Value>& queries,
                             Random& random) {
  using V = typename Index::Value;
  ListIndex<V> list;
  std::vector<V> values;
  for (uint32_t change = 0; change < changes; ++change) {
    if (values.size() < 50 || (values.size() < 150 && random.chance(0.5))) {
      const Vec3d center = random.vector(4 + static_cast<double>(change) / 500);
      values.push_back(value_filling<V>(center, random.positive_vector(1), change + 1));
      index.insert(values.back());
      list.insert(values.back());
    } else {
      std::swap(values[random.below(values.size())], values.back());
      if (!index.remove(values.back())) return "a value was not removed";
      list.remove(values.back());
      values.pop_back();
    }
    if (change % 500 != 0 && change + 1 != changes) continue;
    if (std::string what = IndexJudge(index, list).difference(queries); !what.empty())
      return "change " + std::to_string(change) + ", " + what;
  }
  return "";
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_CHANGED_INDEX_H_
