// A hash grid: moving values of any size in an unbounded world, where only occupied bricks of cells exist. This is the
// writer's side: it takes batches of changes and gives snapshots, which share with it and with each other whatever has
// not changed between them.
//
// One writer; snapshots belong to any thread and never change, whatever happens to the grid they were taken from.
// Values are known by handles, small numbers that the caller gives out; a handle names one value at a time.
//
// Answers never depend on cell sizes: they only cull. The base cell is chosen anew from a sample of the values when
// their number has doubled since or fallen to an eighth, and looked at when all have moved some dozen times. Values are
// filed anew a few thousand with each batch, so that none takes long: meanwhile there are levels of both.
// Invariants: every value lies in the brick of its position on a level at least as wide as it; no brick is empty;
// slots_ says where each value is. |position| <= limits::kMaxCoordinate on each axis.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_HASH_GRID_H_
#define LOCUS_CORE_INDEX_HASH_GRID_HASH_GRID_H_

#include <cstdint>
#include <memory>
#include <vector>

#include "absl/types/span.h"
#include "core/index/hash_grid/brick_builder.h"
#include "core/index/hash_grid/grid_snapshot.h"

namespace locus {

struct HashGridOptions {
  // Edge of the base cell until the first choice, rounded up to a power of two between 2^-20 and 2^31.
  double cell_size = 8;
  // Number of values at which the cell size is chosen from them for the first time; the largest number = never. Up to
  // about a thousand values the choice comes to one brick, which is a list in columns.
  size_t first_choice = 8;
};

// What one batch changes. Handles are distinct within `removed` and `moves` together, and within `inserted`; a value
// may be removed and inserted again under its handle.
struct GridBatch {
  absl::Span<const uint32_t> removed;
  GridMoves moves;
  absl::Span<const GridItem> inserted;
};

class HashGrid {
 public:
  HashGrid() : HashGrid(HashGridOptions()) {}
  explicit HashGrid(const HashGridOptions& options);

  size_t size() const { return size_; }
  // The value of `handle`, which is in the grid.
  GridRef at(uint32_t handle) const;
  // Asks for the memory of at(), some time before it is needed.
  [[gnu::always_inline]] void prefetch_slot(uint32_t handle) const { __builtin_prefetch(&slots_[handle]); }
  // Returns the bytes of what the snapshots so far hold and later ones will not. O(n) and the bricks that are touched.
  size_t apply(const GridBatch& batch);

  // The first values of a grid, as another grid had them whose cell_size() is given: it fits, and is not chosen again
  // until it would be anyway.
  void fill(absl::Span<const GridItem> items, double cell_size);

  // visit(GridRef) for each value, until it returns false. O(size).
  template <class Visit>
  void for_each(const Visit& visit) const {
    for (const std::unique_ptr<Level>& level : levels_) {
      const bool go_on =
          level->table->for_each([&](uint32_t number) { return internal::for_each_value(*bricks_[number], visit); });
      if (!go_on) return;
    }
  }
  // O(levels), and the lists of bricks where they changed.
  GridSnapshot snapshot();

  double cell_size() const;

 private:
  struct Level {
    explicit Level(int of_exponent) : exponent(of_exponent) {}

    int exponent;
    double cells_per_unit = internal::cells_per_unit(exponent);
    double reach = 0;  // of the values since the level was empty last
    Aabbd bounds;      // of bricks, likewise
    size_t size = 0;
    std::shared_ptr<internal::BrickTable> table = std::make_shared<internal::BrickTable>();
    bool table_is_shared = false;
  };
  // A brick as the writer knows it: places of bricks that are gone are used again.
  struct Known {
    internal::BrickPlace place;
    Level* level = nullptr;
  };

  void remove(uint32_t handle);
  void move_away(const GridMove& move, const GridMoves& moves);
  void insert_moved(const GridItem& before, const GridMove& move, const GridMoves& moves);
  void insert(const GridItem& item);
  int exponent_for(float reach) const;
  Level& level_for(float reach);
  uint32_t brick_for(Level& level, const internal::GridKey& key);
  uint32_t touch(uint32_t brick);
  void change(uint32_t brick, const internal::BrickChange& change);
  void group_changes();
  absl::Span<const internal::BrickChange> changes_of(size_t touched) const;
  void prefetch_changes(size_t touched) const;
  void rebuild_bricks(const GridMoves& moves);
  void clear_batch();
  void replace_brick(uint32_t brick, internal::BrickPtr next);
  void drop_brick(uint32_t brick);
  internal::BrickTable& writable_table(Level& level);
  void move_all(const GridMoves& moves);
  void apply_to_bricks(const GridBatch& batch);
  bool moves_nearly_all(const GridBatch& batch) const;
  void gather_all(const GridMoves& moves);
  bool choice_is_stale() const;
  void choose_cell_size();
  void start_refiling(int base_exponent);
  void refile(size_t values);

  int base_exponent_;
  size_t first_choice_;
  size_t size_at_choice_ = 0;
  size_t changes_since_choice_ = 0;
  size_t size_ = 0;
  size_t replaced_bytes_ = 0;                   // by the batch at work
  std::vector<std::unique_ptr<Level>> levels_;  // coarse to fine
  std::vector<Known> known_;                    // by brick
  std::vector<uint32_t> free_bricks_;
  std::vector<uint32_t> stale_;          // bricks that may hold values of cells chosen before
  std::vector<uint32_t> touch_numbers_;  // by brick: its number among the touched, if the list there says so
  internal::BrickArray bricks_;
  std::vector<internal::GridSlot> slots_;  // by handle
  internal::BrickNumbers bricks_by_handle_;

  // The batch at work.
  struct Change {
    uint32_t touched;
    internal::BrickChange change;
  };
  std::vector<uint32_t> touched_;
  std::vector<uint32_t> change_counts_;  // by number among the touched, then where their changes begin
  std::vector<Change> changes_;
  std::vector<uint32_t> away_;  // moves to other bricks
  std::vector<internal::BrickChange> grouped_;
  std::vector<GridItem> arrivals_;
  internal::BrickBuilder builder_;
  // Where it moves nearly all.
  struct Remains {
    bool gathered = false;  // else the brick's changes say all
    absl::Span<const internal::BrickSource> sources;
  };
  std::vector<Remains> remains_;  // by number among the touched
  std::vector<internal::BrickSource> sources_;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_HASH_GRID_HASH_GRID_H_
