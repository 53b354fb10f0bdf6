// Builder of brick versions: makes the next version of a brick from its present one and the changes of one batch. One
// builder per grid, for its writer; one thread at a time. It keeps its buffers between bricks.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_BRICK_BUILDER_H_
#define LOCUS_CORE_INDEX_HASH_GRID_BRICK_BUILDER_H_

#include <vector>

#include "absl/types/span.h"
#include "core/base/scratch.h"
#include "core/index/hash_grid/brick_sources.h"

namespace locus::internal {

// Change of one value in a brick.
struct BrickChange {
  static constexpr uint32_t kArrives = ~0u;
  static constexpr uint32_t kLeaves = ~0u;

  uint32_t slot;   // slot of a present value, as GridSlot::slot; or kArrives
  uint32_t index;  // index of the arrival; or of the move, if the value stays in the brick; or kLeaves
};

// Moves and arrivals to which the indices of changes refer. All borrowed.
struct BatchParts {
  GridMoves moves;
  absl::Span<const GridItem> arrivals;
};

class BrickBuilder {
 public:
  // Begins a batch. `slots`, indexed by handle, receives the new slot of each value that changes its slot. Both
  // arguments are borrowed until end().
  void begin(const BatchParts& parts, std::vector<GridSlot>& slots);
  // Ends the batch and frees large buffers.
  void end() { clear_scratch(sources_); }

  // Returns the next version of the brick, null if no value remains. `old` is null for a brick that was empty. `index`
  // is the index of the brick. Each value occurs at most once in `changes`, but a value that leaves may also arrive.
  // O(values of the brick) or, for few changes, O(changes).
  BrickPtr apply(const Brick* old, const BrickGeometry& geometry, uint32_t index,
                 absl::Span<const BrickChange> changes);

  // Returns the next version made from `sources`, the values of `old` that stay, and from `changes`, which must be
  // arrivals only.
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
  std::vector<uint32_t> sorted_changes_, recent_changes_;  // by slot: move index, kLeaves or kStays
  std::vector<BrickSource> sources_;
  float max_extent_ = 0;  // of the brick that is built
};

}  // namespace locus::internal

#endif  // LOCUS_CORE_INDEX_HASH_GRID_BRICK_BUILDER_H_
