// List: an array that culls no value and passes every value to the visitor. The list is the test oracle of every other
// structure, and the fastest structure for a few values.
//
// Threads: const members may run concurrently; insert and remove need exclusive use.
// Invariant: slots_ maps the id of each value in the list to its slot in values_, and has no other entries.
// Source: Hughes et al., Computer Graphics: Principles and Practice, 3rd ed., 2013, ch. 37 (List).
#ifndef LOCUS_CORE_INDEX_LIST_LIST_INDEX_H_
#define LOCUS_CORE_INDEX_LIST_LIST_INDEX_H_

#include <cstdint>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/types/span.h"
#include "core/base/check.h"
#include "core/index/spatial_index.h"

namespace locus {

template <class V, class T = PrimitiveTraits<V>>
requires Bounded<V, T>
class ListIndex {
  using S = typename T::Scalar;

 public:
  using Value = V;
  using Traits = T;

  // Appends a value. Precondition: its id is not in the list. Amortised O(1).
  void insert(const V& value) {
    const bool added = slots_.try_emplace(Traits::id(value), values_.size()).second;
    LOCUS_CHECK(added);
    values_.push_back(value);
    LOCUS_DCHECK_CALL(check_invariants(values_.size() - 1));
  }

  // Removes the value with the id of `value`. Returns false and changes nothing if the list has no value with this id.
  // O(1): the last value moves to the free slot, so the order of values is not preserved.
  bool remove(const V& value) {
    const auto found = slots_.find(Traits::id(value));
    if (found == slots_.end()) return false;
    const size_t slot = found->second;
    slots_.erase(found);
    if (slot + 1 != values_.size()) {
      values_[slot] = std::move(values_.back());
      slots_[Traits::id(values_[slot])] = slot;
    }
    values_.pop_back();
    LOCUS_DCHECK_CALL(check_invariants(slot));
    return true;
  }

  bool contains(const V& value) const { return slots_.contains(Traits::id(value)); }
  size_t size() const { return values_.size(); }
  absl::Span<const V> values() const { return values_; }

  template <RayVisitor<V, T> Visitor>
  void visit_ray(const SlabRay<S>&, Visitor& visitor, Work& work) const {
    visit_all(visitor, work);
  }

  template <RegionVisitor<V, T> Visitor>
  void visit_region(Visitor& visitor, Work& work) const {
    visit_all(visitor, work);
  }

  template <PointVisitor<V, T> Visitor>
  void visit_nearest(const Vec3d&, Visitor& visitor, Work& work) const {
    visit_all(visitor, work);
  }

 private:
  // Checks that the array and the map have the same size. `slot` is the slot that has just changed. If the array still
  // has this slot, checks that the map has the entry of the value in the slot. O(1).
  void check_invariants(size_t slot) const {
    LOCUS_DCHECK_EQ(values_.size(), slots_.size());
    if (slot >= values_.size()) return;
    const auto found = slots_.find(Traits::id(values_[slot]));
    LOCUS_DCHECK(found != slots_.end());
    LOCUS_DCHECK_EQ(found->second, slot);
  }

  template <class Visitor>
  void visit_all(Visitor& visitor, Work& work) const {
    for (const V& value : values_) {
      ++work.tests;
      if (!visitor.visit(value)) return;
    }
  }

  std::vector<V> values_;
  absl::flat_hash_map<uint64_t, size_t> slots_;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_LIST_LIST_INDEX_H_
