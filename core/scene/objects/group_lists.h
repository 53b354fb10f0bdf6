// Lists of the objects of each group: the handles of all objects whose group is not 0. Used by the writer of a scene,
// whose readers keep snapshots: a snapshot costs O(1), and later changes copy only what they change. Lists change only
// if an object is inserted, removed or put into another group, so moves cost nothing.
//
// Threads: like a standard container; a snapshot is independent of its source. Invariants: a handle is in at most one
// list; the lists are doubly linked; a group without objects has no list.
#ifndef LOCUS_CORE_SCENE_OBJECTS_GROUP_LISTS_H_
#define LOCUS_CORE_SCENE_OBJECTS_GROUP_LISTS_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/check.h"
#include "core/base/ids.h"
#include "core/base/persistent_array.h"
#include "core/base/persistent_id_table.h"

namespace locus {

class GroupLists {
 public:
  // Returns a snapshot for readers. O(1).
  GroupLists snapshot();

  // Add a handle to the list of its group, and remove it. Group 0 has no list, so that nothing happens. O(1), plus
  // copies of leaves that a snapshot shares. Precondition: the handle is in no list, or in the list of the group.
  void add(Group group, uint32_t handle);
  void remove(Group group, uint32_t handle);

  // Returns the number of objects in the group; 0 for group 0. O(1).
  size_t count(Group group) const {
    const uint32_t list = group == 0 ? kNone : index_.find(group);
    return list == kNone ? 0 : lists_[list].count;
  }
  // Calls visit(handle) for each object of the group, until visit() returns false. Returns false if it did.
  template <class Visit>
  bool for_each(Group group, const Visit& visit) const {
    const uint32_t list = group == 0 ? kNone : index_.find(group);
    if (list == kNone) return true;
    size_t visited = 0;
    for (uint32_t handle = lists_[list].first; handle != kNone; handle = links_[handle].next) {
      LOCUS_DCHECK_LT(visited, size_t{lists_[list].count});
      ++visited;
      if (!visit(handle)) return false;
    }
    LOCUS_DCHECK_EQ(visited, size_t{lists_[list].count});
    return true;
  }

  // Returns the size in bytes of what these lists do not share with `other`. O(leaves).
  size_t unshared_bytes(const GroupLists& other) const {
    return index_.unshared_bytes(other.index_) + lists_.unshared_bytes(other.lists_) +
           links_.unshared_bytes(other.links_);
  }

 private:
  static constexpr uint32_t kNone = PersistentIdTable<>::kNone;
  struct List {
    uint32_t first = kNone;
    uint32_t count = 0;
  };
  struct Link {
    uint32_t next = kNone;
    uint32_t previous = kNone;
  };

  PersistentIdTable<> index_;          // index in lists_ of each group that has objects
  PersistentArray<List, 256> lists_;   // indexed by the values of index_
  PersistentArray<Link, 1024> links_;  // indexed by handle
  std::vector<uint32_t> free_lists_;   // indices in lists_ that no group has; of the writer only
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_OBJECTS_GROUP_LISTS_H_
