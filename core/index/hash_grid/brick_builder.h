// Makes the next version of a brick from the one before and the changes of one batch. For the one writer of a grid; it
// keeps room for its work from brick to brick, so one per grid and one thread at a time.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_BRICK_BUILDER_H_
#define LOCUS_CORE_INDEX_HASH_GRID_BRICK_BUILDER_H_

#include <vector>

#include "absl/types/span.h"
#include "core/base/scratch.h"
#include "core/index/hash_grid/brick_sources.h"

namespace locus::internal {

// One change of one brick.
struct BrickChange {
  static constexpr uint32_t kArrives = ~0u;
  static constexpr uint32_t kLeaves = ~0u;

  uint32_t slot;    // as in GridSlot, of a value that is here; or kArrives
  uint32_t number;  // of what arrives, among the arrivals; of its move, if it stays; or kLeaves
};

// What the numbers of changes mean. All borrowed.
struct BatchParts {
  GridMoves moves;
  absl::Span<const GridItem> arrivals;
};

class BrickBuilder {
 public:
  // A batch begins: what its changes mean, and where to write where each value is now that is not where it was, by
  // handle. Both until end().
  void begin(const BatchParts& parts, std::vector<GridSlot>& slots);
  void end() { clear_scratch(sources_); }

  // Null when no value remains. `old` is null for a brick that was empty; each value occurs at most once in `changes`,
  // but one that leaves may also arrive. `number` is the brick's. O(values of the brick) or, for few changes,
  // O(changes).
  BrickPtr apply(const Brick* old, const BrickPlace& place, uint32_t number, absl::Span<const BrickChange> changes);

  // The same from what remains of `old` and the arrivals, which are all that `changes` hold.
  BrickPtr build(const Brick* old, const BrickPlace& place, uint32_t number, absl::Span<const BrickSource> sources,
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
  template <class PlaceOf>
  void write(GridBlock& block, uint32_t flag, const Brick* old, absl::Span<const BrickSource> sources,
             const PlaceOf& place_of);
  GridForm form_of(const Brick* old, const BrickSource& source) const;
  bool any_form(const Brick* old, absl::Span<const BrickSource> sources) const;
  bool any_form_arrives(absl::Span<const BrickChange> changes) const;

  const BrickPlace* place_ = nullptr;
  uint32_t number_ = 0;
  BatchParts parts_;
  std::vector<GridSlot>* slots_ = nullptr;
  std::vector<uint32_t> sorted_changes_, recent_changes_;  // by slot: the number of the move, kLeaves or kStays
  std::vector<BrickSource> sources_;
  float largest_reach_ = 0;  // of the brick at work
};

}  // namespace locus::internal

#endif  // LOCUS_CORE_INDEX_HASH_GRID_BRICK_BUILDER_H_
