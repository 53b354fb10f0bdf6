// Builder of brick versions: makes the next version of a brick from its present version and the changes of one batch.
// The writer of a grid uses one builder for all bricks, so that the buffers of the builder are reused. One thread at a
// time.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_BRICK_BUILDER_H_
#define LOCUS_CORE_INDEX_HASH_GRID_BRICK_BUILDER_H_

#include <vector>

#include "absl/types/span.h"
#include "core/base/scratch.h"
#include "core/index/hash_grid/brick_sources.h"

namespace locus::internal {

// Change of one value in a brick: the value arrives, leaves, or moves within the brick.
struct BrickChange {
  static constexpr uint32_t kArrives = ~0u;
  static constexpr uint32_t kLeaves = ~0u;

  uint32_t slot;   // present slot, encoded as in GridSlot::slot, or kArrives
  uint32_t index;  // index in BatchParts::arrivals if the value arrives, in BatchParts::moves if it moves, or kLeaves
};

// Arrays to which BrickChange::index refers. Borrows all arrays.
struct BatchParts {
  GridMoves moves;
  absl::Span<const GridItem> arrivals;
};

class BrickBuilder {
 public:
  // Begins a batch. `slots`, indexed by handle, receives the new slot of each value that changes its slot. The arrays
  // of `parts` and `slots` are borrowed until end().
  void begin(const BatchParts& parts, std::vector<GridSlot>& slots);
  // Ends the batch and frees the buffers that are large.
  void end() {
    clear_scratch(sources_);
    clear_scratch(runs_);
  }

  // Returns the next version of the brick, or null if no value remains. `old` is the present version, null for a brick
  // that was empty. `index` is the index of the brick in the grid's array. `changes` has at most one change for each
  // handle, or two if a value leaves and a new value with the same handle arrives. O(values of the brick) or, for few
  // changes, O(changes).
  BrickPtr apply(const Brick* old, const BrickGeometry& geometry, uint32_t index,
                 absl::Span<const BrickChange> changes);

  // Returns the next version of the brick, or null if no value remains. Sorts all values again: the values of `old`
  // that stay in the brick, given by `sources`, and the values that arrive, given by `changes`. Precondition: all
  // `changes` are arrivals.
  BrickPtr build(const Brick* old, const BrickGeometry& geometry, uint32_t index, absl::Span<const BrickSource> sources,
                 absl::Span<const BrickChange> changes);
  // Returns the next version of the brick, or null if no value remains. Copies runs of adjacent values, which is faster
  // than build(): most values stay in their cells. Preconditions: `old` has no log and no dead values, the batch has no
  // rotations, and all `changes` are arrivals. `block_moves` has the moves of all slots of `old`.
  BrickPtr rebuild(const Brick& old, const BrickGeometry& geometry, uint32_t index, const BlockMoves& block_moves,
                   absl::Span<const BrickChange> changes);

 private:
  // Adjacent values that remain adjacent: the slots [begin, begin + count) become the slots from `to` on.
  struct Run {
    uint32_t begin;
    uint32_t to;
    uint32_t count;
  };
  static bool is_few(const Brick* old, absl::Span<const BrickChange> changes);
  BrickPtr sort_anew(const Brick* old, absl::Span<const BrickChange> changes);
  BrickPtr change_few(const Brick& old, absl::Span<const BrickChange> changes);
  void mark_changes(const Brick& old, absl::Span<const BrickChange> changes);
  void add_source(const GridBlock& block, uint32_t origin, uint32_t change);
  void add_arrivals(absl::Span<const BrickChange> changes);
  BrickPtr sorted_by_cell(const Brick* old, absl::Span<const BrickSource> sources);
  BrickPtr new_brick(std::shared_ptr<const GridBlock> sorted) const;
  void add_run(const Run& run);
  void find_runs(const GridBlock& from, absl::Span<const CellChange> cell_changes,
                 std::array<uint32_t, kBrickCells + 1>& next);
  void copy_run(const GridBlock& from, const Run& run, absl::Span<const uint32_t> moves, GridBlock& block);
  void prefetch(const GridBlock::Values* from, const BrickSource& source) const;
  template <class SlotOf>
  void write(GridBlock& block, uint32_t flag, const Brick* old, absl::Span<const BrickSource> sources,
             const SlotOf& slot_of);
  GridForm form_of(const Brick* old, const BrickSource& source) const;
  bool any_form(const Brick* old, absl::Span<const BrickSource> sources) const;
  bool any_form_arrives(absl::Span<const BrickChange> changes) const;
  void check_changes(const Brick* old, absl::Span<const BrickChange> changes) const;
  void check_sorted(const Brick& brick) const;
  void check_recent(const Brick& brick, uint32_t begin) const;
  void check_value(const Brick& brick, const GridBlock& block, uint32_t slot, uint32_t flag) const;

  const BrickGeometry* geometry_ = nullptr;
  uint32_t index_ = 0;
  BatchParts parts_;
  std::vector<GridSlot>* slots_ = nullptr;
  std::vector<uint32_t> sorted_changes_, recent_changes_;  // indexed by slot: move index, kLeaves or kStays
  std::vector<BrickSource> sources_;
  std::vector<Run> runs_;
  float max_extent_ = 0;  // upper bound of the extents of values in the version being built
};

}  // namespace locus::internal

#endif  // LOCUS_CORE_INDEX_HASH_GRID_BRICK_BUILDER_H_
