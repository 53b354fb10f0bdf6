// Writer's store of a scene's objects: finds objects by id, applies batches of changes and makes immutable sets for
// readers. One thread at a time uses the store; any thread may use the sets.
//
// A handle identifies one lifetime of an object, from its insertion to its removal; if the store tracks lifetimes, a
// teleport also ends a lifetime and begins the next. Invariants: every object has a handle of its own, below
// handle_count(); the table from ids to handles and the grid hold the same objects, and the lists of groups those of
// them that belong to a group; every handle below handle_count()
// belongs to an object, is free, or is quarantined. A store that tracks lifetimes quarantines the handle of a removed
// object: no other object gets the handle while an object set in the history contains the removed object.
#ifndef LOCUS_CORE_SCENE_OBJECTS_OBJECT_STORE_H_
#define LOCUS_CORE_SCENE_OBJECTS_OBJECT_STORE_H_

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "absl/container/flat_hash_set.h"
#include "absl/types/span.h"
#include "core/base/check.h"
#include "core/index/hash_grid/hash_grid.h"
#include "core/scene/objects/object_set.h"
#include "core/scene/objects/tick_moves.h"

namespace locus {

class ObjectStore {
 public:
  static constexpr uint32_t kNoHandle = PersistentIdTable<>::kNone;

  ObjectStore() = default;
  explicit ObjectStore(const HashGridOptions& options) : grid_(options) {}

  // Starts to track lifetimes and displacements, which queries about the past need. Call before the first insertion.
  void track_lifetimes() {
    LOCUS_DCHECK_EQ(next_handle_, 0u);
    moves_ = std::make_unique<TickMoves>();
  }
  // Begins `tick`. `oldest_tick` is the oldest tick of the history. Frees the quarantined handles of objects that were
  // removed in `oldest_tick` or earlier: the object sets that the history has for `oldest_tick` and for later ticks do
  // not contain these objects. Requires track_lifetimes().
  void start_tick(uint64_t tick, uint64_t oldest_tick);
  // Returns the displacement of objects since start_tick(); an empty Displacement if lifetimes are not tracked.
  Displacement displacement() { return moves_ == nullptr ? Displacement() : moves_->displacement(); }

  // Fixes the size of the grid's base cells; 0 lets the grid choose it: see HashGrid::fix_cell_size().
  void fix_cell_size(double cell_size) { grid_.fix_cell_size(cell_size); }

  size_t size() const { return grid_.size(); }
  std::optional<Object> find(Id id) const;
  bool contains(const Object& object) const { return handle(object.id) != kNoHandle; }
  // Returns the handle of an id, or kNoHandle if no object has the id. O(1), like contains().
  uint32_t handle(Id id) const { return handles_.find(id); }
  // Writes the handle of ids[i], or kNoHandle, to handles[i]: faster than a call of handle() for each id. The spans
  // have the same size.
  void find_handles(absl::Span<const Id> ids, absl::Span<uint32_t> handles) const {
    LOCUS_DCHECK_EQ(ids.size(), handles.size());
    handles_.find(ids, handles);
  }
  // Returns the number of lifetimes that have ended. While it stays the same, the handle of every known id stays the
  // same.
  uint64_t ended_lives() const { return ended_lives_; }
  // Returns one more than the highest handle that was ever used.
  size_t handle_count() const { return next_handle_; }
  GridRef at(uint32_t handle) const {
    LOCUS_DCHECK_LT(handle, next_handle_);
    return grid_.at(handle);
  }
  // Prefetches the memory that at(handle) reads first.
  [[gnu::always_inline]] void prefetch_slot(uint32_t handle) const { grid_.prefetch_slot(handle); }

  // Replaces the objects `removed` by `inserted`. An id in both lists is an update of one object, unless the id is in
  // `replaced`: then the lifetime of the old object ends, and a new lifetime begins. Preconditions: every removed
  // object is present; after the removals, no object with an inserted id is present. O(removed + inserted), plus the
  // size of the changed bricks. The compounds of inserted objects must be owned by shared pointers; the compounds of
  // removed objects may be destroyed. Returns the number of replaced bytes: the bytes that existing object sets hold
  // and later sets will not share.
  size_t apply(absl::Span<const Object> removed, absl::Span<const Object> inserted,
               const absl::flat_hash_set<Id>& replaced = {});
  // Moves objects. Precondition: the handles belong to objects and are distinct. Returns the number of replaced bytes,
  // like apply().
  size_t move(const GridMoves& moves);
  void insert(const Object& object) { apply({}, {&object, 1}); }
  // Inserts the objects of `chunks` into an empty store with cells of about `cell_size`. Frees each chunk once its
  // objects are copied. Returns false if an id occurs twice; after that, the store must not be used any more.
  bool fill(std::vector<std::vector<Object>> chunks, double cell_size);
  // Removes the object with the id of `object`. Returns false and changes nothing if contains() is false.
  bool remove(const Object& object);

  // Calls fn(object) for each object of `group`, which is not 0. O(objects of the group).
  template <class Fn>
  void for_each_in(Group group, const Fn& fn) const {
    groups_.for_each(group, [&](uint32_t handle) {
      fn(object_of(grid_.at(handle)));
      return true;
    });
  }

  // Calls fn(object) for each object. O(size).
  template <class Fn>
  void for_each(Fn&& fn) const {
    grid_.for_each([&fn](const GridRef& value) {
      fn(object_of(value));
      return true;
    });
  }

  // Returns an immutable set of the current objects. O(1) in the number of objects.
  ObjectSet snapshot() {
    if (groups_changed_) groups_snapshot_ = std::make_shared<const GroupLists>(groups_.snapshot());
    groups_changed_ = false;
    return {grid_.snapshot(), handles_.snapshot(), groups_snapshot_, compounds_.snapshot()};
  }

 private:
  // Checks the invariants of the class comment. O(1).
  void check_invariants() const;
  uint32_t new_handle();
  void free_handle(uint32_t handle);
  std::vector<uint32_t> handles_of(absl::Span<const Object> objects) const;
  // Puts the object `handle` from one group into another; 0 stands for no group.
  void change_group(uint32_t handle, Group from, Group to);
  GridItem begin_life(const Object& object);
  GridItem continue_life(const Object& object, uint32_t handle);

  HashGrid grid_;
  PersistentIdTable<> handles_;
  GroupLists groups_;
  bool groups_changed_ = false;  // since groups_snapshot_ was made
  std::shared_ptr<const GroupLists> groups_snapshot_;
  CompoundTable compounds_;  // owns the compounds of all objects
  std::vector<uint32_t> free_handles_;
  uint32_t next_handle_ = 0;
  uint64_t ended_lives_ = 0;
  struct QuarantinedHandle {
    uint32_t handle;
    uint64_t tick;  // tick in which the object was removed
  };
  std::deque<QuarantinedHandle> quarantined_handles_;  // handles of removed objects, ascending by tick
  uint64_t tick_ = 0;                                  // tick of the last start_tick()
  std::unique_ptr<TickMoves> moves_;                   // null unless lifetimes are tracked
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_OBJECTS_OBJECT_STORE_H_
