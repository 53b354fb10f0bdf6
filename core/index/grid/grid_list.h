// Small list: what a cell of a grid holds by default, and the grid's list of the values outside its cells. Tests the
// bounds of all its values.
//
// Threads: const members may run concurrently; insert and remove need exclusive use.
#ifndef LOCUS_CORE_INDEX_GRID_GRID_LIST_H_
#define LOCUS_CORE_INDEX_GRID_GRID_LIST_H_

#include <algorithm>
#include <cstddef>
#include <memory_resource>
#include <utility>
#include <vector>

#include "core/index/spatial_index.h"

namespace locus {

template <class V, class T = PrimitiveTraits<V>>
requires Bounded<V, T>
class GridList {
  using S = typename T::Scalar;

 public:
  using Value = V;
  using Traits = T;

  GridList() = default;
  // Makes an empty list that allocates from `memory`.
  explicit GridList(std::pmr::memory_resource* memory) : entries_(memory) {}

  // Precondition: the list has no value with the same id. Amortised O(1).
  void insert(const V& value) { entries_.push_back({Traits::bounds(value), value}); }

  // Removes the value with the id of `value`. Returns false and changes nothing if there is none. Searches the list:
  // O(n).
  bool remove(const V& value) {
    const auto has_id = [id = Traits::id(value)](const Entry& entry) { return Traits::id(entry.value) == id; };
    const auto found = std::find_if(entries_.begin(), entries_.end(), has_id);
    if (found == entries_.end()) return false;
    if (found + 1 != entries_.end()) *found = std::move(entries_.back());
    entries_.pop_back();
    return true;
  }

  // Searches the list: O(n).
  bool contains(const V& value) const {
    const auto has_id = [id = Traits::id(value)](const Entry& entry) { return Traits::id(entry.value) == id; };
    return std::any_of(entries_.begin(), entries_.end(), has_id);
  }
  size_t size() const { return entries_.size(); }

  template <RayVisitor<V, T> Visitor>
  void visit_ray(const SlabRay<S>& slabs, Visitor& visitor, Work& work) const {
    visit_wanted(visitor, work, [&](const Aabb<S>& bounds) {
      const Interval<S> interval = slabs.interval(bounds);
      return interval.near <= interval.far && interval.far >= 0 && interval.near <= visitor.limit();
    });
  }

  template <RegionVisitor<V, T> Visitor>
  void visit_region(Visitor& visitor, Work& work) const {
    visit_wanted(visitor, work, [&](const Aabb<S>& bounds) { return visitor.overlaps(bounds); });
  }

  template <PointVisitor<V, T> Visitor>
  void visit_nearest(const Vec3d& point, Visitor& visitor, Work& work) const {
    visit_wanted(visitor, work,
                 [&](const Aabb<S>& bounds) { return squared_distance(point, to_double(bounds)) <= visitor.limit(); });
  }

 private:
  struct Entry {
    Aabb<S> bounds;
    V value;
  };

  template <class Visitor, class Wanted>
  void visit_wanted(Visitor& visitor, Work& work, const Wanted& wanted) const {
    for (const Entry& entry : entries_) {
      ++work.cells;
      if (!wanted(entry.bounds)) continue;
      ++work.tests;
      if (!visitor.visit(entry.value)) return;
    }
  }

  std::pmr::vector<Entry> entries_;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_GRID_GRID_LIST_H_
