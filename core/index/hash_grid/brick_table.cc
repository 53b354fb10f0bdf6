#include "core/index/hash_grid/brick_table.h"

#include <utility>

namespace locus::internal {

void BrickTable::put(const Slot& slot) {
  size_t at = slot.hash & mask();
  while (slots_[at].number != kNone) at = (at + 1) & mask();
  slots_[at] = slot;
}

void BrickTable::insert(const GridKey& key, uint32_t number) {
  if (++size_ * 2 > slots_.size()) {
    const std::vector<Slot> before = std::exchange(slots_, std::vector<Slot>(slots_.size() * 2));
    for (const Slot& slot : before)
      if (slot.number != kNone) put(slot);
  }
  put({hash_of(key), number});
}

void BrickTable::erase(const GridKey& key, uint32_t number) {
  size_t at = hash_of(key) & mask();
  while (slots_[at].number != number) {
    LOCUS_CHECK_NE(slots_[at].number, kNone);
    at = (at + 1) & mask();
  }
  slots_[at] = {};
  --size_;
  // Those that had to go past the gap come again.
  for (size_t next = (at + 1) & mask(); slots_[next].number != kNone; next = (next + 1) & mask())
    put(std::exchange(slots_[next], Slot()));
}

}  // namespace locus::internal
