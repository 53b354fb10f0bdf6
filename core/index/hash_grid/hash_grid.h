// The hash grid: moving values of any size in an unbounded world, where only occupied bricks of cells exist. Each value
// is filed once, by its position, on the level whose cells are at least as wide as the value, so that a query looks
// half a cell around itself on each level and misses nothing: no single large value can make all lookups wide.
//
// For one writer and many readers: a copy costs O(1) and never changes, whatever happens to the grid it was taken from.
// Threads: as for a standard container, each grid by itself; grids that share bricks are independent of each other.
//
// Answers never depend on cell sizes: they only cull. The base cell is chosen anew from a sample of the values when
// their number has doubled since, fallen to an eighth, or when all have moved a few times.
// Invariants: levels_ are the levels that hold values, coarse to fine, of distinct exponents, the finest at least
// base_exponent_; size_ is the sum of theirs. |position| <= limits::kMaxCoordinate on each axis.
// Source: Ericson, Real-Time Collision Detection, 2005, 7.2 (hierarchical grids, one cell a value); Schornbaum,
// Hierarchical Hash Grids for Coupled Particle Simulations, 2009.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_HASH_GRID_H_
#define LOCUS_CORE_INDEX_HASH_GRID_HASH_GRID_H_

#include <algorithm>
#include <cstdint>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/types/span.h"
#include "core/base/limits.h"
#include "core/index/hash_grid/cell_size.h"
#include "core/index/hash_grid/grid_level.h"

namespace locus {

struct HashGridOptions {
  // Edge of the base cell until the first choice, rounded up to a power of two between 2^-20 and 2^31.
  double cell_size = 8;
  // Number of values at which the cell size is chosen from them for the first time; the largest number = never.
  size_t first_choice = 1024;
};

struct HashGridStatistics {
  size_t values = 0;
  size_t levels = 0;
  size_t bricks = 0;
  size_t cells = 0;      // occupied
  double cell_size = 0;  // of the base level
  size_t bytes = 0;      // of bricks, cells and values, shared with copies or not; the table of bricks not counted
};

template <Bounded V>
class HashGrid {
  static_assert(std::is_same_v<ScalarOf<V>, double>, "the hash grid culls in double");
  using Traits = PrimitiveTraits<V>;

 public:
  using Value = V;

  HashGrid() : HashGrid(HashGridOptions()) {}
  explicit HashGrid(const HashGridOptions& options)
      : base_exponent_(
            internal::exponent_covering(options.cell_size, internal::kMinCellExponent, internal::kMaxBaseExponent)),
        first_choice_(options.first_choice) {}

  // An immutable copy for readers, O(1) in the number of values. Copying does the same.
  HashGrid snapshot() const { return *this; }

  size_t size() const { return size_; }
  // Whether the id of `value`, given as it was inserted, is here. O(values in its cell).
  bool contains(const V& value) const;
  // The id must not be here. O(values in its cell): batches belong in apply().
  void insert(const V& value) { apply({}, {&value, 1}); }
  // False, and no change, when contains() is false.
  bool remove(const V& value) {
    if (!contains(value)) return false;
    apply({&value, 1}, {});
    return true;
  }
  // Removes the values of one span, as they were inserted, and inserts those of the other: a move is in both. All
  // removed ids must be here, no inserted one may remain here. Every touched cell is rebuilt once: O(n log n) and the
  // sum of those cells.
  void apply(absl::Span<const V> removed, absl::Span<const V> inserted);

  // As SpatialIndex asks. A ray costs the bricks along it or all of a level's, whichever are fewer; a region likewise.
  template <RayVisitor<V> Visitor>
  void visit_ray(const SlabRay<double>& ray, Visitor& visitor, Work& work) const {
    for (const Level& level : levels_) {
      if (!level.visit_ray(ray, visitor, work)) return;
    }
  }
  template <RegionVisitor<V> Visitor>
  void visit_region(Visitor& visitor, Work& work) const {
    for (const Level& level : levels_) {
      if (!level.visit_region(visitor, work)) return;
    }
  }

  // fn(value) for each, in an order that depends on the grid's history only. O(size).
  template <class Fn>
  void for_each(Fn&& fn) const;
  // O(cells).
  HashGridStatistics statistics() const;
  size_t bytes() const { return statistics().bytes; }

 private:
  using Level = internal::GridLevel<V>;
  using Brick = internal::Brick<V>;

  // Where a value is filed.
  struct Place {
    int exponent;
    internal::GridKey brick;
    int cell;
    friend auto operator<=>(const Place&, const Place&) = default;
  };
  // One removal or insertion.
  struct Change {
    Place place;
    bool inserts;
    const V* value;
    friend bool operator<(const Change& a, const Change& b) {
      return std::tie(a.place, a.inserts) < std::tie(b.place, b.inserts);
    }
  };
  using Changes = absl::Span<const Change>;

  Place place_of(const V& value) const;
  const Level* find_level(int exponent) const;
  Level& level_for(int exponent);
  std::vector<Change> changes_of(absl::Span<const V> removed, absl::Span<const V> inserted) const;
  void leave_ghosts(std::vector<Change>& changes) const;  // a planted bug
  void apply_sorted(Changes changes);
  void apply_to_brick(Level& level, Changes changes);
  void choose_cell_size();
  void rebuild(int base_exponent);
  bool choice_is_stale() const;

  int base_exponent_;
  size_t first_choice_;
  size_t size_at_choice_ = 0;
  size_t changes_since_choice_ = 0;
  size_t size_ = 0;
  std::vector<Level> levels_;
};

}  // namespace locus

#include "core/index/hash_grid/hash_grid_impl.h"

#endif  // LOCUS_CORE_INDEX_HASH_GRID_HASH_GRID_H_
