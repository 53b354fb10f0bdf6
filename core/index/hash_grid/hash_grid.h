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
#include <cmath>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/types/span.h"
#include "core/base/limits.h"
#include "core/index/hash_grid/cell_size.h"
#include "core/index/hash_grid/grid_change.h"
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
        first_choice_(std::max<size_t>(options.first_choice, 1)) {}

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
  using Place = internal::GridPlace;
  using Change = internal::GridChange<V>;
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

template <Bounded V>
typename HashGrid<V>::Place HashGrid<V>::place_of(const V& value) const {
  const Vec3d position = Traits::position(value);
  LOCUS_DCHECK(max_component(abs(position)) <= limits::kMaxCoordinate);
  const double reach = internal::reach_of(Traits::bounds(value), position);
  const int exponent = internal::exponent_covering(2 * reach, base_exponent_, internal::kMaxCellExponent);
  const internal::GridKey cell = internal::cell_of(position, internal::cells_per_unit(exponent));
  return {exponent, internal::brick_of(cell), internal::number_in_brick(cell)};
}

template <Bounded V>
const typename HashGrid<V>::Level* HashGrid<V>::find_level(int exponent) const {
  for (const Level& level : levels_) {
    if (level.exponent() == exponent) return &level;
  }
  return nullptr;
}

template <Bounded V>
typename HashGrid<V>::Level& HashGrid<V>::level_for(int exponent) {
  auto at = levels_.begin();
  while (at != levels_.end() && at->exponent() > exponent) ++at;
  if (at == levels_.end() || at->exponent() != exponent) at = levels_.insert(at, Level(exponent));
  return *at;
}

template <Bounded V>
bool HashGrid<V>::contains(const V& value) const {
  const Place place = place_of(value);
  const Level* level = find_level(place.exponent);
  const Brick* brick = level == nullptr ? nullptr : level->find(place.brick);
  const typename Brick::Cell* cell = brick == nullptr ? nullptr : brick->cell(place.cell);
  return cell != nullptr && std::any_of(cell->begin(), cell->end(), [&value](const auto& entry) {
           return Traits::id(entry.value) == Traits::id(value);
         });
}

template <Bounded V>
void HashGrid<V>::apply(absl::Span<const V> removed, absl::Span<const V> inserted) {
  if (size_ == 0 && inserted.size() >= first_choice_) {  // files a bulk load once, at the right size
    internal::EvenSample sample(inserted.size());
    for (const V& value : inserted) sample.offer(value);
    base_exponent_ = internal::choose_cell_exponent(sample.values(), inserted.size());
    size_at_choice_ = inserted.size();
    changes_since_choice_ = 0;
  }
  apply_sorted(changes_of(removed, inserted));
  changes_since_choice_ += removed.size() + inserted.size();
  if (choice_is_stale()) choose_cell_size();
}

template <Bounded V>
std::vector<typename HashGrid<V>::Change> HashGrid<V>::changes_of(absl::Span<const V> removed,
                                                                  absl::Span<const V> inserted) const {
  std::vector<Change> changes;
  changes.reserve(removed.size() + inserted.size());
  for (const V& value : removed) changes.push_back({place_of(value), false, &value});
  for (const V& value : inserted) changes.push_back({place_of(value), true, &value});
  if (planted(PlantedBug::kGhostAfterMove)) leave_ghosts(changes);
  std::stable_sort(changes.begin(), changes.end());
  return changes;
}

template <Bounded V>
void HashGrid<V>::leave_ghosts(std::vector<Change>& changes) const {
  absl::flat_hash_map<uint64_t, Place> moved_to;
  for (const Change& change : changes) {
    if (change.inserts) moved_to.emplace(Traits::id(*change.value), change.place);
  }
  std::erase_if(changes, [&moved_to](const Change& change) {
    const auto moved = moved_to.find(Traits::id(*change.value));
    return !change.inserts && moved != moved_to.end() && moved->second != change.place;
  });
}

template <Bounded V>
void HashGrid<V>::apply_sorted(Changes changes) {
  while (!changes.empty()) {
    Changes in_level = internal::take_group(
        changes, [](const Change& a, const Change& b) { return a.place.exponent == b.place.exponent; });
    Level& level = level_for(in_level[0].place.exponent);
    while (!in_level.empty()) {
      apply_to_brick(level, internal::take_group(in_level, [](const Change& a, const Change& b) {
                       return a.place.brick == b.place.brick;
                     }));
    }
  }
  std::erase_if(levels_, [](const Level& level) { return level.size() == 0; });
}

template <Bounded V>
void HashGrid<V>::apply_to_brick(Level& level, Changes changes) {
  const internal::GridKey key = changes[0].place.brick;
  const Brick* before = level.find(key);
  Brick brick = before == nullptr ? Brick() : *before;
  std::vector<uint64_t> removed;
  std::vector<const V*> inserted;
  size_t total_removed = 0;
  const size_t total = changes.size();
  while (!changes.empty()) {
    const Changes in_cell =
        internal::take_group(changes, [](const Change& a, const Change& b) { return a.place.cell == b.place.cell; });
    removed.clear();
    inserted.clear();
    for (const Change& change : in_cell) {
      if (change.inserts) {
        inserted.push_back(change.value);
        const Aabbd bounds = Traits::bounds(*change.value);
        level.extend(bounds, internal::reach_of(bounds, Traits::position(*change.value)));
      } else {
        removed.push_back(Traits::id(*change.value));
      }
    }
    std::sort(removed.begin(), removed.end());
    total_removed += removed.size();
    const int number = in_cell[0].place.cell;
    brick.replace_cell(number, internal::updated_cell<V>(brick.cell(number), removed, inserted));
  }
  const size_t total_inserted = total - total_removed;
  level.replace(key, std::move(brick), total_inserted, total_removed);
  size_ = size_ + total_inserted - total_removed;
}

template <Bounded V>
bool HashGrid<V>::choice_is_stale() const {
  if (size_ < first_choice_) return false;
  return size_ >= 2 * size_at_choice_ || size_ <= size_at_choice_ / 8 || changes_since_choice_ >= 16 * size_;
}

template <Bounded V>
void HashGrid<V>::choose_cell_size() {
  internal::EvenSample sample(size_);
  for_each([&sample](const V& value) { sample.offer(value); });
  const int exponent = internal::choose_cell_exponent(sample.values(), size_);
  size_at_choice_ = size_;
  changes_since_choice_ = 0;
  if (exponent != base_exponent_) rebuild(exponent);
}

template <Bounded V>
void HashGrid<V>::rebuild(int base_exponent) {
  std::vector<V> values;
  values.reserve(size_);
  for_each([&values](const V& value) { values.push_back(value); });
  base_exponent_ = base_exponent;
  levels_.clear();
  size_ = 0;
  apply_sorted(changes_of({}, values));
}

template <Bounded V>
template <class Fn>
void HashGrid<V>::for_each(Fn&& fn) const {
  for (const Level& level : levels_) {
    level.for_each_brick([&fn](const internal::GridKey&, const Brick& brick) {
      for (const typename Brick::Slot& slot : brick.slots) {
        for (const typename Brick::Entry& entry : *slot.cell) fn(entry.value);
      }
    });
  }
}

template <Bounded V>
HashGridStatistics HashGrid<V>::statistics() const {
  HashGridStatistics result;
  result.values = size_;
  result.levels = levels_.size();
  result.cell_size = std::ldexp(1.0, base_exponent_);
  for (const Level& level : levels_) {
    result.bricks += level.bricks();
    level.for_each_brick([&result](const internal::GridKey&, const Brick& brick) {
      result.cells += brick.slots.size();
      result.bytes += sizeof(Brick) + brick.slots.capacity() * sizeof(typename Brick::Slot);
      for (const typename Brick::Slot& slot : brick.slots) {
        result.bytes += sizeof(*slot.cell) + slot.cell->capacity() * sizeof(typename Brick::Entry);
      }
    });
  }
  return result;
}

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_HASH_GRID_HASH_GRID_H_
