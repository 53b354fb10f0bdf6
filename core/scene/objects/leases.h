// Leases of a scene's writers, and the objects that belong to them. An object belongs to the lease of the writer that
// inserted it last, if that writer had a lease then. Which leases have run out is not decided here: the core reads no
// clock. Scene::end_lease() ends a lease and removes its objects.
//
// Threads: like a standard container; a snapshot is independent of its source. Invariants: an object belongs to at most
// one lease; only writers with a lease own objects; at most limits::kMaxLeases leases.
#ifndef LOCUS_CORE_SCENE_OBJECTS_LEASES_H_
#define LOCUS_CORE_SCENE_OBJECTS_LEASES_H_

#include <cstdint>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/scene/objects/group_lists.h"

namespace locus {

// Lease of a writer: if no batch of the writer arrives for `lease_ms` milliseconds, its objects are removed.
struct Lease {
  uint64_t writer = 0;
  uint32_t lease_ms = 0;

  friend bool operator==(const Lease&, const Lease&) = default;
};

// Leases at one revision, ascending by writer, and the handles of their objects, which are listed by writer. Immutable.
struct LeaseTable {
  std::vector<Lease> leases;
  GroupLists objects;
};

class Leases {
 public:
  bool empty() const { return leases_.empty(); }
  size_t size() const { return leases_.size(); }
  bool has(uint64_t writer) const { return leases_.contains(writer); }

  // Begins the lease of a writer or changes its length.
  void begin(uint64_t writer, uint32_t lease_ms);
  // Ends the lease of a writer. Precondition: no object belongs to it. Does nothing if the writer has no lease.
  void end(uint64_t writer);

  // Returns the writer to whose lease the object belongs; 0 if it belongs to none.
  uint64_t owner(uint32_t handle) const { return handle < owners_.size() ? owners_[handle] : 0; }
  // Makes the object belong to the lease of `writer`, or to none if `writer` is 0. O(1).
  void give(uint32_t handle, uint64_t writer);
  // Calls visit(handle) for each object of the writer's lease. O(objects of the lease).
  template <class Visit>
  void for_each(uint64_t writer, const Visit& visit) const {
    objects_.for_each(writer, [&visit](uint32_t handle) {
      visit(handle);
      return true;
    });
  }

  // Returns the leases, ascending by writer. O(leases * log(leases)).
  std::vector<Lease> list() const;
  // Returns the number of changes of list() so far.
  uint64_t changes() const { return changes_; }
  // Returns the table that a snapshot on the disk contains. O(leases * log(leases)).
  LeaseTable table();

 private:
  absl::flat_hash_map<uint64_t, uint32_t> leases_;  // length by writer
  GroupLists objects_;                              // handles by writer
  std::vector<uint64_t> owners_;                    // by handle
  uint64_t changes_ = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_OBJECTS_LEASES_H_
