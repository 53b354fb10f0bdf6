#include "core/index/hash_grid/brick_table.h"

#include <utility>

namespace locus::internal {

void BrickTable::put(const Slot& slot) {
  size_t slot_index = slot.hash & mask();
  while (slots_[slot_index].brick != kNone) slot_index = (slot_index + 1) & mask();
  slots_[slot_index] = slot;
}

void BrickTable::check_invariants(const GridKey& key, uint32_t brick, bool expected) const {
  LOCUS_DCHECK_LE(size_ * 2, slots_.size());
  LOCUS_DCHECK_EQ(slots_.size() & mask(), 0u);
  const uint32_t found = find(key, [brick](uint32_t candidate) { return candidate == brick; });
  LOCUS_DCHECK_EQ(found, expected ? brick : kNone);
}

void BrickTable::insert(const GridKey& key, uint32_t brick) {
  LOCUS_DCHECK_NE(brick, kNone);
  LOCUS_DCHECK_CALL(check_invariants(key, brick, false));
  if (++size_ * 2 > slots_.size()) {
    const std::vector<Slot> old_slots = std::exchange(slots_, std::vector<Slot>(slots_.size() * 2));
    for (const Slot& slot : old_slots)
      if (slot.brick != kNone) put(slot);
  }
  put({hash_of(key), brick});
  LOCUS_DCHECK_CALL(check_invariants(key, brick, true));
}

void BrickTable::erase(const GridKey& key, uint32_t brick) {
  size_t slot_index = hash_of(key) & mask();
  while (slots_[slot_index].brick != brick) {
    LOCUS_CHECK_NE(slots_[slot_index].brick, kNone);
    slot_index = (slot_index + 1) & mask();
  }
  slots_[slot_index] = {};
  --size_;
  // Reinserts the following entries up to the next free slot, since find() stops at a free slot and would miss them.
  for (size_t next = (slot_index + 1) & mask(); slots_[next].brick != kNone; next = (next + 1) & mask())
    put(std::exchange(slots_[next], Slot()));
  LOCUS_DCHECK_CALL(check_invariants(key, brick, false));
}

}  // namespace locus::internal
