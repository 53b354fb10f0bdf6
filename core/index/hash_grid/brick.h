// Bricks, the unit in which the hash grid stores and shares values: 4x4x4 cells, of which only the occupied ones exist,
// each with its values in one array. Bricks and cells are immutable once shared; a changed brick shares its unchanged
// cells with the one before, so that a small batch copies little.
//
// Invariants of a shared brick: `slots` are those of the set bits of `occupied`, in order, none of them empty; bounds
// are exactly the merged bounds of the values.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_BRICK_H_
#define LOCUS_CORE_INDEX_HASH_GRID_BRICK_H_

#include <algorithm>
#include <bit>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "absl/types/span.h"
#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/geometry/primitive_traits.h"
#include "core/index/work.h"

namespace locus::internal {

template <Bounded V>
struct Brick {
  struct Entry {
    Aabbd bounds;  // of the value, kept since computing them may cost more than the test
    V value;
  };
  using Cell = std::vector<Entry>;
  struct Slot {
    Aabbd bounds;
    std::shared_ptr<const Cell> cell;
  };

  uint64_t occupied = 0;  // bit number_in_brick()
  Aabbd bounds;
  std::vector<Slot> slots;

  bool empty() const { return slots.empty(); }
  // Null where the cell is not occupied.
  const Cell* cell(int number) const {
    return (occupied >> number & 1) == 0 ? nullptr : slots[rank(number)].cell.get();
  }
  // Puts `entries` in place of the cell; an empty one is taken out. Leaves `bounds` to update_bounds().
  void replace_cell(int number, Cell entries);
  void update_bounds();

  // Calls visit(entry) for the entries whose own bounds and whose cell's bounds `reaches`; false once visit() was.
  // Cells from the last to the first where `backwards`.
  template <class Reaches, class Visit>
  bool visit(bool backwards, const Reaches& reaches, Work& work, const Visit& visit_entry) const;

 private:
  size_t rank(int number) const { return static_cast<size_t>(std::popcount(occupied & ((uint64_t{1} << number) - 1))); }
};

// The cell without the values of ids in `removed`, which is sorted and of which each must be found, and with those of
// `inserted`. `old` is null for a cell that was not occupied.
template <Bounded V>
typename Brick<V>::Cell updated_cell(const typename Brick<V>::Cell* old, absl::Span<const uint64_t> removed,
                                     absl::Span<const V* const> inserted) {
  using Traits = PrimitiveTraits<V>;
  const size_t before = old == nullptr ? 0 : old->size();
  LOCUS_CHECK_LE(removed.size(), before);
  typename Brick<V>::Cell cell;
  cell.reserve(before - removed.size() + inserted.size());
  for (size_t i = 0; i < before; ++i) {
    const auto& entry = (*old)[i];
    if (!std::binary_search(removed.begin(), removed.end(), Traits::id(entry.value))) cell.push_back(entry);
  }
  LOCUS_CHECK_EQ(before - cell.size(), removed.size());
  for (const V* value : inserted) cell.push_back({Traits::bounds(*value), *value});
  return cell;
}

template <Bounded V>
void Brick<V>::replace_cell(int number, Cell entries) {
  const uint64_t bit = uint64_t{1} << number;
  const auto slot = slots.begin() + static_cast<std::ptrdiff_t>(rank(number));
  if (entries.empty()) {
    if ((occupied & bit) != 0) slots.erase(slot);
    occupied &= ~bit;
    return;
  }
  Aabbd cell_bounds;
  for (const Entry& entry : entries) cell_bounds = merge(cell_bounds, entry.bounds);
  Slot made{cell_bounds, std::make_shared<const Cell>(std::move(entries))};
  if ((occupied & bit) != 0) {
    *slot = std::move(made);
  } else {
    slots.insert(slot, std::move(made));
  }
  occupied |= bit;
}

template <Bounded V>
void Brick<V>::update_bounds() {
  bounds = Aabbd();
  for (const Slot& slot : slots) bounds = merge(bounds, slot.bounds);
}

template <Bounded V>
template <class Reaches, class Visit>
bool Brick<V>::visit(bool backwards, const Reaches& reaches, Work& work, const Visit& visit_entry) const {
  const size_t first = planted(PlantedBug::kDropCell) && slots.size() > 1 ? 1 : 0;
  for (size_t i = first; i < slots.size(); ++i) {
    const Slot& slot = slots[backwards ? slots.size() - 1 - (i - first) : i];
    ++work.cells;
    if (slots.size() > 1 && !reaches(slot.bounds)) continue;
    for (const Entry& entry : *slot.cell) {
      if (slot.cell->size() > 1 && !reaches(entry.bounds)) continue;
      ++work.tests;
      if (!visit_entry(entry)) return false;
    }
  }
  return true;
}

}  // namespace locus::internal

#endif  // LOCUS_CORE_INDEX_HASH_GRID_BRICK_H_
