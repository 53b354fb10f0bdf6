// Ticks at which objects of a scene expire. Used by the writer of the scene, whose readers keep tables of the remaining
// ticks. Costs nothing for objects that do not expire.
//
// An expiry is stored as a key: the number of ticks from base_ to the expiry. So restarting the ticks of a scene only
// changes base_, and the remaining ticks of all objects stay the same. Threads: the writer's, one at a time; any thread
// may read an ExpiryTable. Invariants: queue_ has exactly the handles whose key is not 0, ascending by key; first_ is
// the lowest key.
#ifndef LOCUS_CORE_SCENE_OBJECTS_EXPIRIES_H_
#define LOCUS_CORE_SCENE_OBJECTS_EXPIRIES_H_

#include <cstdint>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "absl/container/btree_set.h"
#include "absl/container/flat_hash_set.h"
#include "core/base/persistent_array.h"
#include "core/base/planted_bug.h"

namespace locus {

// Expiries of the objects of one revision. Immutable.
class ExpiryTable {
 public:
  static constexpr uint32_t kKeysPerLeaf = 512;
  using Keys = PersistentArray<uint64_t, kKeysPerLeaf>;  // indexed by handle; 0: the object does not expire

  ExpiryTable(Keys keys, uint64_t base, size_t count) : keys_(std::move(keys)), base_(base), count_(count) {}

  // Returns the number of ticks from `tick`, the tick of the revision, until the object expires; 0 if it does not.
  uint64_t remaining(uint32_t handle, uint64_t tick) const {
    const uint64_t key = handle < keys_.size() ? keys_[handle] : 0;
    return key == 0 ? 0 : key - (tick - base_);
  }
  // Returns the number of objects that expire.
  size_t count() const { return count_; }
  size_t unshared_bytes(const ExpiryTable* other) const {
    return keys_.unshared_bytes(other == nullptr ? Keys() : other->keys_);
  }

 private:
  Keys keys_;
  uint64_t base_;
  size_t count_;
};

class Expiries {
 public:
  bool empty() const { return queue_.empty(); }
  // Returns true if an object expires at `tick` or earlier. `tick` is not below the tick of the scene. O(1).
  bool due(uint64_t tick) const { return ticks_until(tick) >= first_ && !queue_.empty(); }
  // Returns the handles of the objects that expire at `tick` or earlier, in the order of their expiries. O(handles).
  std::vector<uint32_t> due_handles(uint64_t tick) const;

  // Makes the object expire `expire_ticks` ticks after `tick`, the tick of the scene; with 0, never. Returns true if
  // the expiry changed. Precondition: no object is due at `tick`. O(log(size)).
  bool set(uint32_t handle, uint64_t tick, uint64_t expire_ticks);
  // Forgets the expiry of a removed object.
  void erase(uint32_t handle);
  // Gives the expiry of the object `from` to the object `to`, which has none: both are handles of one object, which
  // began a new lifetime.
  void transfer(uint32_t from, uint32_t to);
  // Continues at tick `to` instead of `from`. The numbers of remaining ticks stay the same. O(1).
  void restart(uint64_t from, uint64_t to);

  // Returns the table for readers; null if no object expires. O(1).
  std::shared_ptr<const ExpiryTable> table();
  // Returns an upper bound of the bytes of earlier tables that were replaced since the last call of this function.
  size_t take_replaced_bytes() { return std::exchange(replaced_bytes_, 0); }

 private:
  // Checks the invariants of the class comment, except the order of the queue. O(1).
  void check_invariants() const;
  // Returns the lowest key that is not due at `tick`, minus 1.
  uint64_t ticks_until(uint64_t tick) const {
    return tick - base_ - (planted(PlantedBug::kExpiryLate) && tick != base_ ? 1 : 0);
  }
  uint64_t key(uint32_t handle) const { return handle < keys_.size() ? keys_[handle] : 0; }
  void store(uint32_t handle, uint64_t key);
  // Writes a key, and counts the leaf that a table may share.
  void put(uint32_t handle, uint64_t key);
  // Makes `tick` the base. O(size * log(size)).
  void rebase(uint64_t tick);

  ExpiryTable::Keys keys_;
  absl::btree_set<std::pair<uint64_t, uint32_t>> queue_;  // key and handle
  uint64_t first_ = std::numeric_limits<uint64_t>::max();
  uint64_t base_ = 0;
  bool changed_ = false;  // since table_ was made
  std::shared_ptr<const ExpiryTable> table_;
  absl::flat_hash_set<uint32_t> changed_leaves_;  // leaves of keys_ that were changed since table_ was made
  size_t replaced_bytes_ = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_OBJECTS_EXPIRIES_H_
