// Finite grid: divides a box into equal cells, for values of about one size that are spread evenly. Built at once for a
// whole tick, for example in an arena, or changed value by value.
//
// `Cell` is the index that holds the values of one cell: a list unless the caller nests another structure, such as
// Grid<V, T, Octree<V, T>>. A cell needs to be a SpatialIndex of the same values; insert() and remove() of the grid
// exist if the cell has them. Values that are not wholly within the bounds of the grid, or that touch more cells than
// the options allow, are in one list that every query tests.
//
// Threads: const members may run concurrently; insert and remove need exclusive use.
// Invariant: A value within the bounds is in every cell that layout_.cells_of() returns for its bounds, and in no
// other; each cell keeps the values that are in this cell alone apart from those that are in several. No visit loses a
// value. cells_of() is monotone, so a region and a value that touch have a common cell. A ray is not clipped to its
// cells, and one of the cells of a value is entered no later than the value (GridWalk). One of the cells of a value is
// at most as far from a point as the value, because both distances are computed by the same monotone steps. Source:
// Hughes et al., Computer Graphics: Principles and Practice, 3rd ed., 2013, ch. 37 (grids).
#ifndef LOCUS_CORE_INDEX_GRID_GRID_H_
#define LOCUS_CORE_INDEX_GRID_GRID_H_

#include <cstdint>
#include <memory_resource>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/index/grid/cell_visitor.h"
#include "core/index/grid/grid_layout.h"
#include "core/index/grid/grid_list.h"
#include "core/index/grid/grid_shells.h"
#include "core/index/grid/grid_walk.h"
#include "core/index/spatial_index.h"

namespace locus {

struct GridOptions {
  Aabbd bounds;          // of the cells; empty: around all values of build()
  double cell_size = 0;  // 0: so that there are about as many cells as values of build(), see chosen_cell_size()
  GridOrder order = GridOrder::kXMajor;
  // Values that touch more cells lie in the list of values outside the cells, so that large values cost no more memory.
  uint32_t max_cells_per_value = 4096;
  // Allocates the tables and the lists of cells, for example an arena that is released after the tick. Must outlive the
  // grid. Nested structures use their own memory.
  std::pmr::memory_resource* memory = std::pmr::get_default_resource();
};

// Size of a grid. A reference is one entry of a value in a cell or in the list outside the cells.
struct GridShape {
  size_t cells;
  size_t occupied_cells;  // cells that hold a value or held one
  size_t references;
  size_t outside;  // values outside the cells
};

template <class V, class T = PrimitiveTraits<V>, SpatialIndex Cell = GridList<V, T>>
requires Bounded<V, T>
class Grid {
  using S = typename T::Scalar;
  static_assert(std::same_as<typename Cell::Value, V> && std::same_as<typename Cell::Traits, T>);

 public:
  using Value = V;
  using Traits = T;

  // Makes an empty grid. Without bounds in the options it has no cells, and insert() appends to the list outside them;
  // with bounds the options must have a cell size, too.
  explicit Grid(const GridOptions& options = {}) : Grid(options, {}) {}

  // Builds a grid of `values`. Preconditions: their ids are unique, and their bounds are finite and not empty.
  // O(cells + references), if a cell is built in linear time.
  static Grid build(const std::vector<V>& values, const GridOptions& options = {}) {
    Grid grid(options, values);
    grid.places_.reserve(values.size());
    if constexpr (kBuildsCells) {
      grid.build_cells(values);
    } else {
      for (const V& value : values) grid.insert(value);
    }
    LOCUS_DCHECK_CALL(grid.check_invariants());
    return grid;
  }

  // Inserts a value. Preconditions: those of build(). O(cells that the value touches).
  void insert(const V& value) requires MutableSpatialIndex<Cell> {
    const Aabb<S> bounds = place(value);
    if (outside(bounds)) {
      outside_.insert(value);
      return;
    }
    const GridCells cells = layout_.cells_of(bounds);
    references_ += cells.count();
    for_each_cell(cells, [&](size_t index) {
      Content& content = content_of(index);
      (cells.count() > 1 ? content.shared : content.alone).insert(value);
      return true;
    });
    LOCUS_DCHECK_CALL(check_value(value, bounds));
  }

  // Removes the value with the id of `value`. Returns false and changes nothing if the grid has no value with this id.
  // Searches the list of each cell that the value touches: O(values in these cells), and O(values outside the cells) if
  // the value is there.
  bool remove(const V& value) requires MutableSpatialIndex<Cell> {
    const auto found = places_.find(Traits::id(value));
    if (found == places_.end()) return false;
    const Aabb<S> bounds = found->second;
    places_.erase(found);
    if (outside(bounds)) return outside_.remove(value);
    const GridCells cells = layout_.cells_of(bounds);
    references_ -= cells.count();
    for_each_cell(cells, [&](size_t index) {
      Content& content = content_of(index);
      const bool removed = (cells.count() > 1 ? content.shared : content.alone).remove(value);
      LOCUS_DCHECK(removed);
      return removed && !planted(PlantedBug::kGridReferenceLeft);
    });
    return true;
  }

  bool contains(const V& value) const { return places_.contains(Traits::id(value)); }
  size_t size() const { return places_.size(); }
  const GridLayout<S>& layout() const { return layout_; }
  // Returns the numbers of cells and references. O(1).
  GridShape shape() const {
    const auto count = [this](int axis) { return static_cast<size_t>(layout_.count(axis)); };
    return {count(0) * count(1) * count(2), contents_.size(), references_ + outside_.size(), outside_.size()};
  }

  // Passes candidates to `visitor`: those outside the cells, then those of the cells in the order in which the ray
  // enters the cells.
  template <RayVisitor<V, T> Visitor>
  void visit_ray(const SlabRay<S>& slabs, Visitor& visitor, Work& work) const {
    internal::CellVisitor<V, T, Visitor> inner(visitor, work);
    visit_index(outside_, inner, work, [&](const auto& index, Work& w) { index.visit_ray(slabs, inner, w); });
    if (layout_.table_size() == 0) return;
    for (GridWalk<S> walk(layout_, slabs); !walk.done() && !inner.ended(); walk.step()) {
      // The interval of a value may begin before the origin, so the limit of cells is not negative.
      if (walk.near() > std::max(visitor.limit(), S{0}) && !planted(PlantedBug::kGridRayToBorder)) return;
      for_each_in(walk.cells(), [&](int32_t x, int32_t y, int32_t z) {
        if (planted(PlantedBug::kGridWrongAxis)) z = std::min(y, layout_.count(2) - 1);
        if (planted(PlantedBug::kGridClippedToCell)) inner.set_clip(&slabs, slabs.interval(layout_.box_of(x, y, z)));
        return visit_cell(layout_.index(x, y, z), inner, work,
                          [&](const Cell& cell, Work& w) { cell.visit_ray(slabs, inner, w); });
      });
    }
  }

  // Passes to `visitor` the values outside the cells and those of the cells that the bounds of the region touch. The
  // list of a cell passes only values whose own bounds visitor.overlaps() accepts.
  template <RegionVisitor<V, T> Visitor>
  void visit_region(Visitor& visitor, Work& work) const {
    internal::CellVisitor<V, T, Visitor> inner(visitor, work);
    visit_index(outside_, inner, work, [&](const auto& index, Work& w) { index.visit_region(inner, w); });
    Aabb<S> box = visitor.bounds();
    if (inner.ended() || layout_.table_size() == 0 || !overlaps(box, layout_.bounds())) return;
    if (planted(PlantedBug::kGridForgetsMinimum))
      box = {box.min + layout_.bounds().min, box.max + layout_.bounds().min};
    for_each_cell(layout_.cells_of(box), [&](size_t index) {
      return visit_cell(index, inner, work, [&](const Cell& cell, Work& w) { cell.visit_region(inner, w); });
    });
  }

  // Passes candidates to `visitor`: those outside the cells, then those of the cells in shells around the point, until
  // no cell of a shell is within visitor.limit().
  template <PointVisitor<V, T> Visitor>
  void visit_nearest(const Vec3d& point, Visitor& visitor, Work& work) const {
    internal::CellVisitor<V, T, Visitor> inner(visitor, work);
    visit_index(outside_, inner, work, [&](const auto& index, Work& w) { index.visit_nearest(point, inner, w); });
    if (layout_.table_size() == 0) return;
    const auto beyond = [&](double distance) {
      return planted(PlantedBug::kGridNearestStrict) ? distance >= visitor.limit() : distance > visitor.limit();
    };
    GridShells<S> shells(layout_, point);
    for (bool more = !inner.ended(); more && !inner.ended();) {
      more = false;
      for (const GridFace& face : shells.next()) {
        if (beyond(face.squared_distance)) continue;
        more = true;
        for_each_in(face.cells, [&](int32_t x, int32_t y, int32_t z) {
          if (beyond(squared_distance(point, to_double(layout_.box_of(x, y, z))))) return true;
          return visit_cell(layout_.index(x, y, z), inner, work,
                            [&](const Cell& cell, Work& w) { cell.visit_nearest(point, inner, w); });
        });
        if (inner.ended()) return;
      }
    }
  }

 private:
  // True if the cells are built at once, so that a nested tree is divided well.
  static constexpr bool kBuildsCells = requires(std::vector<V> values) { Cell::build(std::move(values)); };

  struct Content {
    Cell alone;   // the values that are in this cell alone
    Cell shared;  // the values that are in other cells, too
  };

  Grid(const GridOptions& options, const std::vector<V>& values)
      : options_(options), table_(options.memory), contents_(options.memory), outside_(options.memory) {
    LOCUS_CHECK(options.cell_size >= 0);
    Aabb<S> bounds;
    double extents = 0;
    for (const V& value : values) {
      const Aabb<S> own = Traits::bounds(value);
      bounds = merge(bounds, own);
      extents += double{max_component(own.extent())};
    }
    if (!options.bounds.empty()) bounds = narrowed(options.bounds);
    if (bounds.empty()) return;
    LOCUS_CHECK(options.cell_size > 0 || !values.empty());
    const double mean_extent = values.empty() ? 0 : extents / static_cast<double>(values.size());
    const double cell_size =
        options.cell_size > 0 ? options.cell_size : chosen_cell_size(to_double(bounds), values.size(), mean_extent);
    layout_ = GridLayout<S>(bounds, cell_size, options.order);
    table_.assign(layout_.table_size(), 0);
  }

  static Aabb<S> narrowed(const Aabbd& box) {
    Aabb<S> result;
    for (int axis = 0; axis < 3; ++axis) {
      result.min[axis] = static_cast<S>(box.min[axis]);
      result.max[axis] = static_cast<S>(box.max[axis]);
    }
    return result;
  }

  static Cell new_cell(std::pmr::memory_resource* memory) {
    if constexpr (std::constructible_from<Cell, std::pmr::memory_resource*>) {
      return Cell(memory);
    } else {
      return Cell();
    }
  }

  static Cell built_cell(std::vector<V> values) {
    if constexpr (std::same_as<decltype(Cell::build(std::move(values))), Cell>) {
      return Cell::build(std::move(values));
    } else {  // a StatusOr
      auto built = Cell::build(std::move(values));
      LOCUS_CHECK(built.ok());
      return *std::move(built);
    }
  }

  // Notes the value and returns its bounds.
  Aabb<S> place(const V& value) {
    const Aabb<S> bounds = Traits::bounds(value);
    const bool added = places_.try_emplace(Traits::id(value), bounds).second;
    LOCUS_CHECK(added);
    return bounds;
  }

  bool outside(const Aabb<S>& bounds) const {
    if (layout_.table_size() == 0) return true;
    if (!locus::contains(layout_.bounds(), bounds)) return !planted(PlantedBug::kGridClampedOutside);
    return layout_.cells_of(bounds).count() > options_.max_cells_per_value;
  }

  Content& content_of(size_t index) {
    if (table_[index] == 0) {
      contents_.push_back({new_cell(options_.memory), new_cell(options_.memory)});
      table_[index] = static_cast<uint32_t>(contents_.size());
    }
    return contents_[table_[index] - 1];
  }

  // Collects the values of each cell, then builds the cells.
  void build_cells(const std::vector<V>& values) {
    std::vector<std::vector<V>> alone, shared;
    for (const V& value : values) {
      const Aabb<S> bounds = place(value);
      if (outside(bounds)) {
        outside_.insert(value);
        continue;
      }
      const GridCells cells = layout_.cells_of(bounds);
      references_ += cells.count();
      for_each_cell(cells, [&](size_t index) {
        content_of(index);
        alone.resize(contents_.size());
        shared.resize(contents_.size());
        (cells.count() > 1 ? shared : alone)[table_[index] - 1].push_back(value);
        return true;
      });
    }
    for (size_t i = 0; i < contents_.size(); ++i) {
      contents_[i].alone = built_cell(std::move(alone[i]));
      contents_[i].shared = built_cell(std::move(shared[i]));
    }
  }

  // Calls fn(x, y, z) for each of the cells until fn returns false.
  template <class Fn>
  static void for_each_in(const GridCells& cells, const Fn& fn) {
    for (int32_t z = cells.first[2]; z <= cells.last[2]; ++z)
      for (int32_t y = cells.first[1]; y <= cells.last[1]; ++y)
        for (int32_t x = cells.first[0]; x <= cells.last[0]; ++x)
          if (!fn(x, y, z)) return;
  }

  // Calls fn(index in table_) for each of the cells until fn returns false.
  template <class Fn>
  void for_each_cell(const GridCells& cells, const Fn& fn) const {
    for_each_in(cells, [&](int32_t x, int32_t y, int32_t z) { return fn(layout_.index(x, y, z)); });
  }

  // Visits one index with visit(index, work). The visitor counts the values that it passes; those that the index counts
  // may have been passed before.
  template <class Index, class Inner, class Visit>
  static bool visit_index(const Index& index, Inner& inner, Work& work, const Visit& visit) {
    if (index.size() == 0) return true;
    Work own;
    visit(index, own);
    work.nodes += own.nodes;
    work.cells += own.cells;
    return !inner.ended();
  }

  // Visits the cell with an index in table_. Returns false if the visitor ends the visit.
  template <class Inner, class Visit>
  bool visit_cell(size_t index, Inner& inner, Work& work, const Visit& visit) const {
    ++work.cells;
    if (table_[index] == 0) return true;
    const Content& content = contents_[table_[index] - 1];
    if (!visit_index(content.alone, inner, work, visit)) return false;
    inner.set_shared(true);
    const bool more = visit_index(content.shared, inner, work, visit);
    inner.set_shared(false);
    return more;
  }

  // Checks that the value is in all of its cells. O(values in these cells).
  void check_value(const V& value, const Aabb<S>& bounds) const {
    const GridCells cells = layout_.cells_of(bounds);
    for_each_cell(cells, [&](size_t index) {
      LOCUS_DCHECK(table_[index] > 0);
      const Content& content = contents_[table_[index] - 1];
      LOCUS_DCHECK((cells.count() > 1 ? content.shared : content.alone).contains(value));
      return true;
    });
  }

  // Checks the number of references. O(occupied cells).
  void check_invariants() const {
    size_t references = 0;
    for (const Content& content : contents_) references += content.alone.size() + content.shared.size();
    LOCUS_DCHECK_EQ(references, references_);
    LOCUS_DCHECK_LE(outside_.size(), size());
  }

  GridOptions options_;
  GridLayout<S> layout_;
  std::pmr::vector<uint32_t> table_;  // for each cell: 1 + its slot in contents_, or 0 if the cell never held a value
  std::pmr::vector<Content> contents_;
  GridList<V, T> outside_;
  absl::flat_hash_map<uint64_t, Aabb<S>> places_;  // id of each value to its bounds
  size_t references_ = 0;                          // values in cells, once for each cell
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_GRID_GRID_H_
