// Oracle of pairs of objects. It works in the slow and simple way that query_oracle.h describes: it measures all pairs,
// sorts and truncates. Used by tests of queries.
#ifndef LOCUS_TESTS_SUPPORT_ORACLE_PAIRS_H_
#define LOCUS_TESTS_SUPPORT_ORACLE_PAIRS_H_

#include <algorithm>
#include <tuple>

#include "core/geometry/shape_distance.h"
#include "tests/support/oracle_scene.h"

namespace locus::test {

inline void answer_block(const OracleScene& scene, const QueryBlock& block, const PairColumns& pairs,
                         BlockResult& result) {
  struct Found {
    OracleScene::Row row;
    Id other;
  };
  const auto has = [](const Object& object, Layers mask) { return mask == 0 || (object.layers & mask) != 0; };
  const auto distance = [&](const Object& a, const Object& b) {
    const Shape &low = a.id < b.id ? a.shape : b.shape, &high = a.id < b.id ? b.shape : a.shape;
    return OracleScene::entry_of(block.precision == Precision::kConservative
                                     ? distance_between(bounds_of(low), bounds_of(high))
                                     : distance_between(low, high));
  };
  std::vector<Found> found;
  for (const OracleScene::OracleObject& whole : scene.wholes_) {
    const Id a_id = whole.id;
    std::vector<Found> own;
    const auto measure = [&](const Object& a, const Object& b) {
      if (block.source == Source::kStatic || a.id == b.id || (a.group != 0 && a.group == b.group)) return;
      if (!scene.wanted(block, 0, a) || !scene.wanted(block, 0, b)) return;
      const bool forwards = has(a, pairs.first_mask) && has(b, pairs.second_mask);
      const bool backwards = has(b, pairs.first_mask) && has(a, pairs.second_mask);
      if (pairs.count == 0 ? a.id > b.id || (!forwards && !backwards) : !forwards) return;
      const float t = distance(a, b);
      if (t > pairs.max_distance) return;
      const auto known = std::find_if(own.begin(), own.end(), [&](const Found& x) { return x.other == b.id; });
      if (known == own.end())
        own.push_back({{t, a.id, kNoTriangle, 0, &whole, nullptr, 0, 0, {}, {}}, b.id});
      else
        known->row.t = std::min(known->row.t, t);
    };
    for (const Object& a : scene.objects_)
      for (const Object& b : scene.objects_)
        if (a.id == a_id) measure(a, b);
    std::sort(own.begin(), own.end(), [&](const Found& x, const Found& y) {
      return pairs.count == 0 ? x.other < y.other : std::tie(x.row.t, x.other) < std::tie(y.row.t, y.other);
    });
    if (pairs.count != 0 && own.size() > pairs.count) own.resize(pairs.count);
    // Keep only the pairs that come after the page position (after_id, after_other).
    if (a_id < block.after_id || (a_id == block.after_id && pairs.after_other == 0)) continue;
    if (a_id == block.after_id && pairs.count == 0) {
      std::erase_if(own, [&](const Found& x) { return x.other <= pairs.after_other; });
    } else if (a_id == block.after_id) {
      const auto last =
          std::find_if(own.begin(), own.end(), [&](const Found& x) { return x.other == pairs.after_other; });
      if (last != own.end()) own.erase(own.begin(), last + 1);
    }
    found.insert(found.end(), own.begin(), own.end());
  }
  std::stable_sort(found.begin(), found.end(), [](const Found& x, const Found& y) { return x.row.id < y.row.id; });
  OracleScene::Rows rows;
  for (const Found& one : found) rows.push_back(one.row);
  OracleScene::count(block, rows, 0, result);
  for (size_t k = 0; k < rows.size(); ++k) {
    OracleScene::write(rows[k], block, result);
    if (OracleScene::columns_of(block).has(Column::kOther)) result.others.push_back(found[k].other);
  }
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_ORACLE_PAIRS_H_
