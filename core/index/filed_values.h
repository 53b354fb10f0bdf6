// Values of an index that lists them at its nodes, by numbers that are called slots. Shared by the trees that divide
// space by planes. A slot of a removed value is free until another value gets it.
//
// Threads: const members may run concurrently; all others need exclusive use.
// Invariants: slots_ maps the id of each value to its slot, and has no other entries; the slots in free_ and those in
// slots_ are all slots.
#ifndef LOCUS_CORE_INDEX_FILED_VALUES_H_
#define LOCUS_CORE_INDEX_FILED_VALUES_H_

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/types/span.h"
#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/index/cut_values.h"
#include "core/index/spatial_index.h"

namespace locus {

// Removes `slot` from the list of a node, which has it. The order of the list may change. O(values of the list).
inline void erase_slot(std::vector<uint32_t>& list, uint32_t slot) {
  const auto found = std::find(list.begin(), list.end(), slot);
  LOCUS_DCHECK(found != list.end());
  *found = list.back();
  list.pop_back();
}

// Rule of a visit for a value that several nodes list. Only planted bugs pass it at every node.
enum class PassEach : uint8_t { kOnce, kAtEveryNode };

template <class V, class Traits>
requires Bounded<V, Traits>
class FiledValues {
  using S = typename Traits::Scalar;

 public:
  struct Entry {
    V value;
    Aabb<S> bounds;
    uint32_t places = 0;  // number of nodes that list the value; 0 in a free slot
  };

  void reserve(size_t count) { entries_.reserve(count); }

  // Stores a value in a free slot and returns the slot. Preconditions: no value has its id; its bounds are finite and
  // not empty. Amortised O(1).
  uint32_t add(V value) {
    LOCUS_CHECK_LT(size(), size_t{limits::kMaxBvhValues});
    const Aabb<S> bounds = Traits::bounds(value);
    LOCUS_CHECK(!bounds.empty() && is_finite(bounds.min) && is_finite(bounds.max));
    const uint32_t slot = free_.empty() ? static_cast<uint32_t>(entries_.size()) : free_.back();
    const bool added = slots_.try_emplace(Traits::id(value), slot).second;
    LOCUS_CHECK(added);
    if (free_.empty()) {
      entries_.push_back({std::move(value), bounds});
    } else {
      free_.pop_back();
      entries_[slot] = {std::move(value), bounds};
    }
    LOCUS_DCHECK_CALL(check_invariants());
    return slot;
  }

  // Frees the slot of the value with the id of `value` and returns the slot, whose entry remains until add() uses it
  // again. Returns nullopt if no value has this id. O(1).
  std::optional<uint32_t> remove(const V& value) {
    const auto found = slots_.find(Traits::id(value));
    if (found == slots_.end()) return std::nullopt;
    const uint32_t slot = found->second;
    slots_.erase(found);
    entries_[slot].places = 0;
    free_.push_back(slot);
    LOCUS_DCHECK_CALL(check_invariants());
    return slot;
  }

  // Moves the values to the slots 0, 1, 2, ... The lists of slots are invalid afterwards. O(values) if a slot is free.
  void close_gaps() {
    if (free_.empty()) return;
    std::vector<bool> is_free(entries_.size());
    for (const uint32_t slot : free_) is_free[slot] = true;
    size_t next = 0;
    for (size_t slot = 0; slot < entries_.size(); ++slot) {
      if (is_free[slot]) continue;
      if (next != slot) entries_[next] = std::move(entries_[slot]);
      slots_[Traits::id(entries_[next].value)] = static_cast<uint32_t>(next);
      ++next;
    }
    entries_.erase(entries_.begin() + static_cast<ptrdiff_t>(next), entries_.end());
    free_.clear();
    LOCUS_DCHECK_CALL(check_invariants());
  }

  bool contains(const V& value) const { return slots_.contains(Traits::id(value)); }
  size_t size() const { return slots_.size(); }
  Entry& operator[](uint32_t slot) { return entries_[slot]; }
  const Entry& operator[](uint32_t slot) const { return entries_[slot]; }
  // Returns the slots of all values, ascending. O(n log n).
  std::vector<uint32_t> slots() const {
    std::vector<uint32_t> slots;
    slots.reserve(size());
    for (const auto& [id, slot] : slots_) slots.push_back(slot);
    std::sort(slots.begin(), slots.end());
    return slots;
  }

  // Passes those values of a node to the visitor whose bounds `wanted` accepts and that were not passed before. Adds
  // the values of the node to work.cells, and those passed to work.tests. Returns false if the visitor ends the visit.
  template <class Wanted, class Visitor>
  bool pass(absl::Span<const uint32_t> list, const Wanted& wanted, Visitor& visitor, PassedValues& passed, Work& work,
            PassEach each = PassEach::kOnce) const {
    for (const uint32_t slot : list) {
      ++work.cells;
      const Entry& entry = entries_[slot];
      if (!wanted(entry.bounds)) continue;
      if (entry.places > 1 && !passed.add(slot) && each == PassEach::kOnce) continue;
      ++work.tests;
      if (!visitor.visit(entry.value)) return false;
    }
    return true;
  }

 private:
  // O(1).
  void check_invariants() const { LOCUS_DCHECK_EQ(entries_.size(), slots_.size() + free_.size()); }

  std::vector<Entry> entries_;
  absl::flat_hash_map<uint64_t, uint32_t> slots_;
  std::vector<uint32_t> free_;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_FILED_VALUES_H_
