// Builder of brick versions: makes the next version of a brick from its present version and the changes of one batch.
// The writer of a grid has one builder, for all bricks. The builder keeps its buffers between bricks. One thread at a
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

  uint32_t slot;   // present slot of the value, encoded as GridSlot::slot; kArrives if it arrives
  uint32_t index;  // index in BatchParts::arrivals if the value arrives, in the moves if it moves; or kLeaves
};

// Arrays to which BrickChange::index refers. All borrowed.
struct BatchParts {
  GridMoves moves;
  absl::Span<const GridItem> arrivals;
};

class BrickBuilder {
 public:
  // Begins a batch. `slots`, indexed by handle, receives the new slot of each value that changes its slot. The arrays
  // of `parts` and `slots` are borrowed until end().
  void begin(const BatchParts& parts, std::vector<GridSlot>& slots);
  // Ends the batch and frees large buffers.
  void end() { clear_scratch(sources_); }

  // Returns the next version of the brick, null if no value remains. `old` is the present version, null for a brick
  // that was empty. `index` is the index of the brick. A value occurs at most once in `changes`, except that a value
  // that leaves may also arrive. O(values of the brick) or, for few changes, O(changes).
  BrickPtr apply(const Brick* old, const BrickGeometry& geometry, uint32_t index,
                 absl::Span<const BrickChange> changes);

  // Returns the next version of the brick, null if no value remains. Sorts all values anew: `sources`, the values of
  // `old` that stay in the brick, and `changes`, which must all be arrivals.
  BrickPtr build(const Brick* old, const BrickGeometry& geometry, uint32_t index, absl::Span<const BrickSource> sources,
                 absl::Span<const BrickChange> changes);

 private:
  static bool is_few(const Brick* old, absl::Span<const BrickChange> changes);
  BrickPtr sort_anew(const Brick* old, absl::Span<const BrickChange> changes);
  BrickPtr change_few(const Brick& old, absl::Span<const BrickChange> changes);
  void mark_changes(const Brick& old, absl::Span<const BrickChange> changes);
  void add_source(const GridBlock& block, uint32_t origin, uint32_t change);
  void add_arrivals(absl::Span<const BrickChange> changes);
  BrickPtr sorted_by_cell(const Brick* old, absl::Span<const BrickSource> sources);
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
  float max_extent_ = 0;  // bound for the version that is built
};

}  // namespace locus::internal

#endif  // LOCUS_CORE_INDEX_HASH_GRID_BRICK_BUILDER_H_
