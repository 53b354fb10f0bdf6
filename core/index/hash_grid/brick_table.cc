#include "core/index/hash_grid/brick_table.h"

#include <utility>

namespace locus::internal {

void BrickTable::put(const Slot& slot) {
  size_t slot_index = slot.hash & mask();
  while (slots_[slot_index].brick != kNone) slot_index = (slot_index + 1) & mask();
  slots_[slot_index] = slot;
}

void BrickTable::insert(const GridKey& key, uint32_t brick) {
  if (++size_ * 2 > slots_.size()) {
    const std::vector<Slot> old_slots = std::exchange(slots_, std::vector<Slot>(slots_.size() * 2));
    for (const Slot& slot : old_slots)
      if (slot.brick != kNone) put(slot);
  }
  put({hash_of(key), brick});
}

void BrickTable::erase(const GridKey& key, uint32_t brick) {
  size_t slot_index = hash_of(key) & mask();
  while (slots_[slot_index].brick != brick) {
    LOCUS_CHECK_NE(slots_[slot_index].brick, kNone);
    slot_index = (slot_index + 1) & mask();
  }
  slots_[slot_index] = {};
  --size_;
  // Reinserts the entries up to the next free slot: the gap must not hide them from find().
  for (size_t next = (slot_index + 1) & mask(); slots_[next].brick != kNone; next = (next + 1) & mask())
    put(std::exchange(slots_[next], Slot()));
}

}  // namespace locus::internal
