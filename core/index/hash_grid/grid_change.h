// The changes of one batch of the hash grid, in the order in which they are applied: by level, brick and cell, so that
// each is rebuilt once. Plain data.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_GRID_CHANGE_H_
#define LOCUS_CORE_INDEX_HASH_GRID_GRID_CHANGE_H_

#include <compare>
#include <cstddef>
#include <tuple>

#include "absl/types/span.h"
#include "core/geometry/primitive_traits.h"
#include "core/index/hash_grid/cell_key.h"

namespace locus::internal {

// Where a value is filed.
struct GridPlace {
  int exponent;  // of the level's cell edge
  GridKey brick;
  int cell;  // number_in_brick()

  friend constexpr auto operator<=>(const GridPlace&, const GridPlace&) = default;
};

// One removal or insertion; the value is borrowed. Removals of a cell come before its insertions.
template <Bounded V>
struct GridChange {
  GridPlace place;
  bool inserts;
  const V* value;

  friend bool operator<(const GridChange& a, const GridChange& b) {
    return std::tie(a.place, a.inserts) < std::tie(b.place, b.inserts);
  }
};

// The leading elements of `all` that `same` as its first, which are taken off it.
template <class T, class Same>
absl::Span<const T> take_group(absl::Span<const T>& all, const Same& same) {
  size_t end = 1;
  while (end < all.size() && same(all[end], all[0])) ++end;
  const absl::Span<const T> group = all.subspan(0, end);
  all.remove_prefix(end);
  return group;
}

}  // namespace locus::internal

#endif  // LOCUS_CORE_INDEX_HASH_GRID_GRID_CHANGE_H_
