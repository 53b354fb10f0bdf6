// Hash table from the keys of one level to the indices of its bricks: open addressing with linear probing, at most half
// full. An entry stores the index and part of the hash but no key, so the caller of find() compares the key with the
// key of the brick. A value type; threads as for a standard container.
//
// Invariant: size_ slots are occupied, at most half of all slots; no slot between the home slot of an entry's hash and
// the slot of the entry is free.
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
  // Returns the brick for which has_key(brick) is true, or kNone if no brick has the key. Calls has_key() only for
  // bricks with the hash of `key`.
  template <class HasKey>
  uint32_t find(const GridKey& key, const HasKey& has_key) const {
    const uint32_t hash = hash_of(key);
    for (size_t slot_index = hash & mask();; slot_index = (slot_index + 1) & mask()) {
      const Slot& slot = slots_[slot_index];
      if (slot.brick == kNone) return kNone;
      if (slot.hash == hash && has_key(slot.brick)) return slot.brick;
    }
  }
  // Adds an entry. Precondition: `brick` is not in the table. Amortised O(1).
  void insert(const GridKey& key, uint32_t brick);
  // Removes an entry. Precondition: `brick` was inserted under `key`.
  void erase(const GridKey& key, uint32_t brick);
  // Calls fn(brick) for each brick. Stops and returns false if fn() returns false.
  template <class Fn>
  bool for_each(const Fn& fn) const {
    for (const Slot& slot : slots_)
      if (slot.brick != kNone && !fn(slot.brick)) return false;
    return true;
  }
  size_t bytes() const { return slots_.capacity() * sizeof(Slot); }

 private:
  struct Slot {
    uint32_t hash = 0;
    uint32_t brick = kNone;
  };
  static uint32_t hash_of(const GridKey& key) { return static_cast<uint32_t>(GridKeyHash()(key)); }
  size_t mask() const { return slots_.size() - 1; }
  void put(const Slot& slot);
  // Checks the load factor, and that the table contains `brick` under `key` if and only if `expected` is true. O(length
  // of the probe).
  void check_invariants(const GridKey& key, uint32_t brick, bool expected) const;

  std::vector<Slot> slots_ = std::vector<Slot>(8);
  size_t size_ = 0;
};

}  // namespace locus::internal

#endif  // LOCUS_CORE_INDEX_HASH_GRID_BRICK_TABLE_H_
