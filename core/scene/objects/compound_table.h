// Compounds of the objects of a scene: owns each compound while at least one object of the store has it, so that the
// grid can store plain addresses. Object sets share the array of owners, which keeps their compounds. The array changes
// only if compounds are inserted, removed or get new parts, so other moves cost nothing.
//
// Threads: one writer; a snapshot is immutable, and any thread may use it.
#ifndef LOCUS_CORE_SCENE_OBJECTS_COMPOUND_TABLE_H_
#define LOCUS_CORE_SCENE_OBJECTS_COMPOUND_TABLE_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/container/flat_hash_set.h"
#include "core/base/persistent_array.h"
#include "core/geometry/compound.h"

namespace locus {

// Owners of compounds, in any order; null for an index that is not in use.
inline constexpr size_t kOwnersPerLeaf = 64;
using CompoundArray = PersistentArray<CompoundPtr, kOwnersPerLeaf>;

// Returns the bytes of `compounds` and of its compounds that `other` does not share. Both may be null.
size_t unshared_bytes(const std::shared_ptr<const CompoundArray>& compounds,
                      const std::shared_ptr<const CompoundArray>& other);

// Invariant: every compound with at least one object has exactly one index.
class CompoundTable {
 public:
  // Count one object more, or less, of a compound; null changes nothing. Preconditions: a shared pointer owns an added
  // compound; remove() undoes an add().
  void add(const Compound* compound);
  void remove(const Compound* compound);
  // Returns the bytes of removed compounds, and of the parts of the array that changes have replaced, since the last
  // call: the bytes that snapshots keep and later snapshots do not share.
  size_t take_replaced_bytes() { return std::exchange(replaced_bytes_, 0); }

  // Returns the owners of all compounds, or null if there are none. O(1).
  std::shared_ptr<const CompoundArray> snapshot();
  // Returns the number of compounds.
  size_t size() const { return uses_.size(); }

 private:
  struct Use {
    uint32_t index;
    uint32_t objects;
  };
  // Sets an owner, and counts the leaf that a snapshot may share.
  void set_owner(uint32_t index, CompoundPtr owner);

  CompoundArray owners_;
  absl::flat_hash_map<const Compound*, Use> uses_;
  std::vector<uint32_t> free_indices_;
  bool changed_ = false;  // since snapshot_ was made
  std::shared_ptr<const CompoundArray> snapshot_;
  absl::flat_hash_set<size_t> changed_leaves_;  // leaves of owners_ that were changed since snapshot_ was made
  size_t replaced_bytes_ = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_OBJECTS_COMPOUND_TABLE_H_
