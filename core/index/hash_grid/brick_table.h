// Finds the bricks of one level by their keys: open addressing with linear probing, at most half full. Entries carry
// a part of the hash only; whoever finds one looks at the brick itself. A value type; threads as for a standard
// container.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_BRICK_TABLE_H_
#define LOCUS_CORE_INDEX_HASH_GRID_BRICK_TABLE_H_

#include <cstdint>
#include <vector>

#include "core/base/check.h"
#include "core/index/hash_grid/cell_key.h"

namespace locus::internal {

class BrickTable {
 public:
  static constexpr uint32_t kNone = ~0u;

  size_t size() const { return size_; }
  // The brick's number for which is_it(number) holds, among those with `key`'s hash; kNone if there is none.
  template <class IsIt>
  uint32_t find(const GridKey& key, const IsIt& is_it) const {
    const uint32_t hash = hash_of(key);
    for (size_t at = hash & mask();; at = (at + 1) & mask()) {
      const Slot& slot = slots_[at];
      if (slot.number == kNone) return kNone;
      if (slot.hash == hash && is_it(slot.number)) return slot.number;
    }
  }
  void insert(const GridKey& key, uint32_t number);
  // `number` is there under `key`.
  void erase(const GridKey& key, uint32_t number);
  // fn(number) for each, until it returns false, which is then returned.
  template <class Fn>
  bool for_each(const Fn& fn) const {
    for (const Slot& slot : slots_)
      if (slot.number != kNone && !fn(slot.number)) return false;
    return true;
  }
  size_t bytes() const { return slots_.capacity() * sizeof(Slot); }

 private:
  struct Slot {
    uint32_t hash = 0;
    uint32_t number = kNone;
  };
  static uint32_t hash_of(const GridKey& key) { return static_cast<uint32_t>(GridKeyHash()(key)); }
  size_t mask() const { return slots_.size() - 1; }
  void put(const Slot& slot);

  std::vector<Slot> slots_ = std::vector<Slot>(8);
  size_t size_ = 0;
};

}  // namespace locus::internal

#endif  // LOCUS_CORE_INDEX_HASH_GRID_BRICK_TABLE_H_
