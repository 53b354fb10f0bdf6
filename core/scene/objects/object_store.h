// The writer's side of a scene's objects: finds them by id and applies batches of changes, from which it makes sets for
// readers. One thread at a time; sets belong to anybody.
//
// A handle names one life of an object, from its birth to its end. Invariant: every object has a handle of its own,
// which no other life gets while a set that holds it may be asked by it; handles_ of the store and of its sets say
// which. A store that follows lives keeps the handles of ended ones until release_handles().
#ifndef LOCUS_CORE_SCENE_OBJECTS_OBJECT_STORE_H_
#define LOCUS_CORE_SCENE_OBJECTS_OBJECT_STORE_H_

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "absl/container/flat_hash_set.h"
#include "absl/types/span.h"
#include "core/index/hash_grid/hash_grid.h"
#include "core/scene/objects/object_set.h"
#include "core/scene/objects/tick_moves.h"

namespace locus {

class ObjectStore {
 public:
  static constexpr uint32_t kNoHandle = PersistentIdTable<>::kNone;

  ObjectStore() = default;
  explicit ObjectStore(const HashGridOptions& options) : grid_(options) {}

  // From now on, before the first object comes: keeps what questions about the past need.
  void track_lifetimes() { moves_ = std::make_unique<TickMoves>(); }
  // For a store that follows lives: `tick` begins; nothing asks sets from before `oldest_tick` any more.
  void start_tick(uint64_t tick, uint64_t oldest_tick);
  // How far objects moved since then; none for a store that does not follow lives.
  Displacement displacement() { return moves_ == nullptr ? Displacement() : moves_->displacement(); }

  size_t size() const { return grid_.size(); }
  std::optional<Object> find(Id id) const;
  bool contains(const Object& object) const { return handle(object.id) != kNoHandle; }
  // kNoHandle for an unknown id. Both O(1).
  uint32_t handle(Id id) const { return handles_.find(id); }
  // Of many, handles[i] for ids[i]: sooner than one by one.
  void find_handles(absl::Span<const Id> ids, absl::Span<uint32_t> handles) const { handles_.find(ids, handles); }
  // One more than the highest handle that was ever given out.
  size_t handle_count() const { return next_handle_; }
  GridRef at(uint32_t handle) const { return grid_.at(handle); }
  // Asks for the memory of at(), some time before it is needed.
  [[gnu::always_inline]] void prefetch_slot(uint32_t handle) const { grid_.prefetch_slot(handle); }

  // Removes the objects of one span, as they are, and inserts those of the other: a changed object is in both, under
  // its id, and lives on unless it is among the `reborn`. All removed ones must be here, no inserted one may remain
  // here. O(n) and the bricks that are touched. Returns the bytes of what the sets so far hold and later ones will not.
  size_t apply(absl::Span<const Object> removed, absl::Span<const Object> inserted,
               const absl::flat_hash_set<Id>& replaced = {});
  // Returns as apply().
  size_t move(const GridMoves& moves);
  void insert(const Object& object) { apply({}, {&object, 1}); }
  // The first objects of a store, all at once, in cells of about that size; `pieces` are gone after. False where an id
  // occurs twice: then the store is of no use any more.
  bool fill(std::vector<std::vector<Object>> pieces, double cell_size);
  // False, and no change, when contains() is false.
  bool remove(const Object& object);

  // fn(object) for each. O(size).
  template <class Fn>
  void for_each(Fn&& fn) const {
    grid_.for_each([&fn](const GridRef& value) {
      fn(object_of(value));
      return true;
    });
  }

  // What readers get. O(1) in the number of objects.
  ObjectSet snapshot() { return {grid_.snapshot(), handles_.snapshot()}; }

 private:
  uint32_t new_handle();
  void free_handle(uint32_t handle);
  std::vector<uint32_t> handles_of(absl::Span<const Object> objects) const;
  GridItem begin_life(const Object& object);
  GridItem continue_life(const Object& object, uint32_t handle);

  HashGrid grid_;
  PersistentIdTable<> handles_;
  std::vector<uint32_t> free_handles_;
  uint32_t next_handle_ = 0;
  struct QuarantinedHandle {
    uint32_t handle;
    uint64_t tick;
  };
  std::deque<QuarantinedHandle> quarantined_handles_;  // of lives that ended, ascending by tick
  uint64_t tick_ = 0;                                  // as start_tick() said
  std::unique_ptr<TickMoves> moves_;                   // null unless lives are followed
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_OBJECTS_OBJECT_STORE_H_
