// Hash grid: an index of moving values of any size in an unbounded world. Only occupied bricks of cells are stored. The
// writer of a scene uses HashGrid to apply batches of changes and to make snapshots for readers. The grid and a
// snapshot share all bricks and blocks that have not changed since the snapshot was made. README.md shows the structure
// in a picture.
//
// Threads: one writer. Snapshots are immutable; any thread may use them, and they may outlive the grid. Values are
// identified by handles, small integers that the caller assigns; a handle identifies one value at a time.
//
// The cell size affects only the cost of a query, never its result. The grid chooses the size of the base cell again,
// from a sample of the values, if the number of values has doubled since the last choice or has fallen to an eighth.
// After each value has changed 64 times on average, the grid also checks whether the size still fits. If the size
// changes, the grid moves the values to the new cells. To bound the time of a batch, each batch moves about 8,000 of
// the values or, if it has more changes than that, as many values as it has changes. Until all values have moved,
// levels of the old and the new size exist side by side. fix_cell_size() chooses the size in the grid's place; the
// values move in the same steps.
//
// The base cell fits the places where most values are. Where values are much sparser, they are stored on a coarser
// level (density_map.h). The grid counts the values of all bricks again, in one step of O(bricks), after one value in
// eight has been inserted, removed or moved to another brick, and moves the values of regions whose density has
// changed, in the same small steps.
//
// Invariants: every value is stored in the brick that contains its position, on a level whose cells are at least as
// wide as the value; no brick is empty; slots_ holds the location of each value. |position| <= limits::kMaxCoordinate
// on each axis.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_HASH_GRID_H_
#define LOCUS_CORE_INDEX_HASH_GRID_HASH_GRID_H_

#include <cstdint>
#include <memory>
#include <vector>

#include "absl/types/span.h"
#include "core/index/hash_grid/brick_builder.h"
#include "core/index/hash_grid/density_map.h"
#include "core/index/hash_grid/grid_snapshot.h"

namespace locus {

struct HashGridOptions {
  // Edge of the cells of the base level until the grid chooses the cell size itself for the first time. Rounded up to a
  // power of two between 2^-20 and 2^31.
  double cell_size = 8;
  // Number of values at which the grid chooses the cell size for the first time; the maximum of size_t means never. For
  // up to about a thousand values the choice results in one brick, which a query scans like a list.
  size_t first_choice = 8;
  // Minimum mean number of values in the occupied bricks of a region of 4x4x4 bricks. If there would be fewer, the
  // values are stored in wider bricks (density_map.h). A brick costs about 900 bytes, as much as eight values.
  double min_brick_values = 8;
};

// Changes of one batch, applied in the order of the members. Borrows all arrays. No handle occurs twice in `removed`
// and `moves` together, nor twice in `inserted`. If a handle occurs in both `removed` and `inserted`, the inserted
// value replaces the removed value.
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
  // Returns the value of `handle`. Precondition: the handle is in use.
  GridRef at(uint32_t handle) const;
  // Prefetches the memory that at() reads first.
  [[gnu::always_inline]] void prefetch_slot(uint32_t handle) const { __builtin_prefetch(&slots_[handle]); }
  // Applies a batch. Returns the size in bytes of the data that the batch replaced: snapshots made before the batch
  // still use this data, later snapshots do not. Cost: O(changes), plus for each touched brick O(changes of the brick)
  // or O(values of the brick).
  size_t apply(const GridBatch& batch);

  // Fixes the size of the base cell: `cell_size`, rounded up to a power of two between 2^-20 and 2^31. 0 ends this: the
  // next batch chooses a size. Values move to other cells only with the batches that follow. O(values) if the size
  // changes.
  void fix_cell_size(double cell_size);

  // Fills an empty grid with `items`. `cell_size` is the cell_size() of another grid that held the same values. The
  // grid uses this size, unless its size is fixed, until the rules at the top of this file require another choice.
  void fill(absl::Span<const GridItem> items, double cell_size);

  // Calls visit(GridRef) for each value, until visit() returns false. O(size).
  template <class Visit>
  void for_each(const Visit& visit) const {
    for (const std::unique_ptr<Level>& level : levels_) {
      const bool keep_going =
          level->table->for_each([&](uint32_t brick) { return internal::for_each_value(*bricks_[brick], visit); });
      if (!keep_going) return;
    }
  }
  // Returns an immutable snapshot of the present state. O(levels). The first change of a level after a snapshot copies
  // the brick table of that level.
  GridSnapshot snapshot();

  // Returns the cell edge of the base level.
  double cell_size() const;

 private:
  struct Level {
    explicit Level(int level_exponent) : exponent(level_exponent) {}

    int exponent;  // cell edge = 2^exponent
    double cells_per_unit = internal::cells_per_unit(exponent);
    double max_extent = 0;  // largest extent of all values since the level was created
    Aabbd bounds;           // bounds of all bricks since the level was created
    size_t size = 0;        // number of values
    std::shared_ptr<internal::BrickTable> table = std::make_shared<internal::BrickTable>();
    bool table_is_shared = false;  // true after a snapshot: the next change copies the table
  };
  // Writer's record of a brick. The index of a dropped brick (one whose last value has left) is reused.
  struct BrickInfo {
    internal::BrickGeometry geometry;
    Level* level = nullptr;
  };

  // Result of gather_all() for one brick: the values that stay in the brick. Values that the current batch moves to
  // another brick are not included.
  struct GatheredBrick {
    enum class How : uint8_t { kChanges, kSources, kMoves };

    How how = How::kChanges;    // what the next version is made from; the other members are unused if kChanges
    size_t begin = 0, end = 0;  // range of the values that stay in sources_ or, if kMoves, of cell_changes_
    size_t first_move = 0;      // if kMoves: index in moves_by_slot_ of the move of slot 0
  };

  void remove(uint32_t handle);
  void move_to_other_brick(const GridMove& move, const GridMoves& moves);
  void insert_moved(const GridItem& before, const GridMove& move, const GridMoves& moves);
  void insert(const GridItem& item);
  // Returns the exponent of the level for a value.
  int exponent_for(float extent, Vec3d position) const;
  // Returns the level with the exponent `exponent`; creates the level if it does not exist.
  Level& level_of(int exponent);
  // Returns the index of the brick with key `key`. If the brick does not exist, creates its entries in brick_info_ and
  // in the level's table; its version in bricks_ is null until rebuild_bricks().
  uint32_t brick_for(Level& level, const internal::GridKey& key);
  // Returns the index of `brick` in touched_; appends `brick` if touched_ does not contain it.
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
  bool moves_at_least_half(const GridBatch& batch) const;
  void gather_all(const GridMoves& moves);
  template <class Leave>
  size_t gather(const internal::Brick& brick, const internal::MoveFinder& finder, bool keeps_rotations,
                GatheredBrick& gathered, const Leave& leave);
  internal::BrickPtr next_version(size_t touched);
  bool choice_is_stale() const;
  void choose_cell_size();
  // Begins to use base cells of 2^exponent, where `bounds` are those of a sample of the values.
  void change_base(int exponent, const Aabbd& bounds);
  void start_refiling(internal::DensityMap density);
  void estimate_density(absl::Span<const GridItem> items, int base_exponent, const Aabbd& bounds);
  bool density_is_stale() const;
  void count_density();
  void refile(size_t max_values);
  void measure_levels();
  void check_in_use(uint32_t handle) const;
  void check_invariants(const GridBatch& batch) const;
  void check_brick(uint32_t brick) const;
  void check_locations(const GridBatch& batch) const;

  internal::DensityMap density_;       // has the exponent of the base level
  bool density_is_estimated_ = false;  // true if density_ was made from a sample
  bool has_fixed_size_ = false;        // see fix_cell_size()
  size_t first_choice_;
  double min_brick_values_;
  size_t size_at_choice_ = 0;
  size_t changes_since_choice_ = 0;
  size_t arrivals_since_count_ = 0;  // values inserted, removed or moved to another brick since count_density()
  size_t size_ = 0;
  size_t replaced_bytes_ = 0;                   // size in bytes of the data that the current batch has replaced
  std::vector<std::unique_ptr<Level>> levels_;  // levels from coarse to fine
  std::vector<BrickInfo> brick_info_;           // records of all bricks, indexed by brick
  std::vector<uint32_t> free_bricks_;
  std::vector<uint32_t> stale_bricks_;     // bricks with values that may have to move to cells of the new size
  std::vector<uint32_t> touched_indices_;  // index of each brick in touched_; valid if the brick is found there
  internal::BrickArray bricks_;
  std::vector<internal::GridSlot> slots_;  // locations of all values, indexed by handle
  internal::BrickIndices bricks_by_handle_;

  // Change of one value in the current batch, and the brick that it changes.
  struct Change {
    uint32_t touched;  // index in touched_
    internal::BrickChange change;
  };
  std::vector<uint32_t> touched_;  // bricks that the current batch changes
  // For each brick in touched_, at the same index: its number of changes; after group_changes(), the end of its range
  // in grouped_.
  std::vector<uint32_t> change_counts_;
  std::vector<Change> changes_;
  std::vector<uint32_t> leaving_moves_;         // indices of the moves of values to other bricks
  std::vector<internal::BrickChange> grouped_;  // changes, grouped by brick in the order of touched_
  std::vector<GridItem> arrivals_;
  internal::BrickBuilder builder_;
  std::vector<GatheredBrick> gathered_;  // for each brick in touched_, at the same index
  std::vector<internal::BrickSource> sources_;
  std::vector<uint32_t> moves_by_slot_;  // BlockMoves::moves of all bricks
  std::vector<internal::CellChange> cell_changes_;
  std::vector<uint8_t> cells_;  // present cells of the slots of one brick
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_HASH_GRID_HASH_GRID_H_
