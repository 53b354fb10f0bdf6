// Makes the next version of a brick from the one before and the changes of one batch. For the one writer of a grid; it
// keeps room for its work from brick to brick, so one per grid and one thread at a time.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_BRICK_BUILDER_H_
#define LOCUS_CORE_INDEX_HASH_GRID_BRICK_BUILDER_H_

#include <vector>

#include "absl/types/span.h"
#include "core/index/hash_grid/brick.h"

namespace locus {

// A new pose for a value that the grid holds.
struct GridMove {
  uint32_t handle = 0;
  bool turns = false;  // else it keeps its rotation
  Quaternion rotation;
  Vec3d position;
};

namespace internal {

// Where the writer finds a value again.
struct GridSlot {
  static constexpr uint32_t kRecent = 1u << 31;  // in `slot`: of Brick::recent, else of Brick::sorted

  uint32_t brick = 0;
  uint32_t slot = 0;
};

// One change of one brick.
struct BrickChange {
  static constexpr uint32_t kArrives = ~0u;
  static constexpr uint32_t kLeaves = ~0u;

  uint32_t slot;    // as in GridSlot, of a value that is here; or kArrives
  uint32_t number;  // of what arrives, among the arrivals; of its move, if it stays; or kLeaves
};

// What the numbers of changes mean. All borrowed.
struct BatchParts {
  absl::Span<const GridMove> moves;
  absl::Span<const GridItem> arrivals;
  bool turns = false;  // whether any of the moves does
};

class BrickBuilder {
 public:
  // Null when no value remains. `old` is null for a brick that was empty; each value occurs at most once in `changes`,
  // but one that leaves may also arrive. Writes where each value is now that is not where it was, by handle; `number`
  // is the brick's. O(values of the brick) or, for few changes, O(changes and what changed lately).
  BrickPtr apply(const Brick* old, const BrickPlace& place, uint32_t number, absl::Span<const BrickChange> changes,
                 const BatchParts& parts, std::vector<GridSlot>& slots);

 private:
  // A value of the next version: where it is to be, and where it was, or which arrival it is.
  struct Source {
    Vec3d position;
    const GridBlock* block;  // null for an arrival
    uint32_t slot;           // in `block`, or the arrival's number
    uint32_t move;           // kNoMove where it stays as it was
    uint32_t cell;
  };
  static constexpr uint32_t kNoMove = ~0u;

  uint32_t cell_of(Vec3d position) const { return static_cast<uint32_t>(place_->cell_of(position)); }
  static bool is_few(const Brick* old, size_t changes);
  BrickPtr sort_anew(const Brick* old, absl::Span<const BrickChange> changes);
  BrickPtr change_few(const Brick& old, absl::Span<const BrickChange> changes);
  void mark_changes(const Brick& old, absl::Span<const BrickChange> changes);
  void add_source(const GridBlock& block, uint32_t slot, uint32_t change);
  void add_sources(const GridBlock& block, const std::vector<uint32_t>& changes, const Brick* brick);
  void add_arrivals(absl::Span<const BrickChange> changes);
  GridForm form_of(const Source& source) const;
  bool any_form(const Brick* old, absl::Span<const BrickChange> changes) const;
  // Writes the sources into `block` at the places that place_of(i) gives for source i. Slots in `before`, which may be
  // null, are known already.
  template <class PlaceOf>
  void write(GridBlock& block, uint32_t flag, const GridBlock* before, const PlaceOf& place_of);

  const BrickPlace* place_ = nullptr;
  uint32_t number_ = 0;
  BatchParts parts_;
  std::vector<GridSlot>* slots_ = nullptr;
  std::vector<uint32_t> sorted_changes_, recent_changes_;  // by slot: the number of the move, kLeaves or kStays
  std::vector<Source> sources_;
};

}  // namespace internal
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_HASH_GRID_BRICK_BUILDER_H_
