// Walk of a ray through the cells of a finite grid, from near to far.
//
// Each border between cells has a padded interval on the ray, as if it were a flat box; its ends are computed from the
// number of the border, never by adding up steps. A cell is entered at the near ends of the borders before it and left
// at the far ends of the borders behind it, so that the intervals of cells that follow each other overlap: a ray along
// a border, or through an edge or a corner, is in all cells that it touches. The walk keeps the range of cells on each
// axis in which the ray is, and yields each cell once, when the ray is in the cell on all three axes.
// No value is lost. Its own interval contains some t >= 0. The first of its cells on an axis is entered at or before t,
// and the last is left at or after t, because the borders contain the value, their pad is at least that of the value
// and each step of the slab test is monotone. So one of its cells is entered at or before t. Source: Amanatides and
// Woo, A Fast Voxel Traversal Algorithm for Ray Tracing, 1987 (the order of the cells).
#ifndef LOCUS_CORE_INDEX_GRID_GRID_WALK_H_
#define LOCUS_CORE_INDEX_GRID_GRID_WALK_H_

#include <cmath>
#include <limits>
#include <utility>

#include "core/geometry/ray.h"
#include "core/index/grid/grid_layout.h"

namespace locus {

// One object per visit. Borrows the layout and the ray.
template <class S>
class GridWalk {
 public:
  GridWalk(const GridLayout<S>& layout, const SlabRay<S>& slabs)
      : layout_(layout), slabs_(slabs), magnitude_(magnitude(layout.bounds())) {
    const Interval<S> whole = slabs.interval(layout.bounds(), magnitude_);
    if (planted(PlantedBug::kGridRayFromInside) && whole.near > 0) return;
    if (!(whole.near <= whole.far && whole.far >= 0)) return;
    done_ = false;
    near_ = std::max(whole.near, S{0});
    far_ = whole.far;
    for (int axis = 0; axis < 3; ++axis) start(axis);
    for (int axis = 0; axis < 3; ++axis) set_cells(axis, axes_[axis].first, axes_[axis].last);
  }

  bool done() const { return done_; }
  // Returns the cells that the ray enters at near(). Each cell of the grid is yielded at most once.
  const GridCells& cells() const { return cells_; }
  S near() const { return near_; }

  // Advances to the next cells. Precondition: not done().
  void step() {
    int entered = 0;
    for (int axis = 1; axis < 3; ++axis) {
      if (axes_[axis].next_near < axes_[entered].next_near) entered = axis;
    }
    const S t = axes_[entered].next_near;
    if (!(t <= far_) || t == kInfinity) {
      done_ = true;
      return;
    }
    near_ = t;
    for (int axis = 0; axis < 3; ++axis) {
      Axis& on_axis = axes_[axis];
      const bool diagonal = planted(PlantedBug::kGridDiagonalStep) && on_axis.next_near == t;
      if (axis == entered || diagonal) {
        advance(axis);
        set_cells(axis, on_axis.last, on_axis.last);
      } else {
        while (on_axis.first < on_axis.last && crossing(axis, on_axis.first + 1).far < t) ++on_axis.first;
        set_cells(axis, on_axis.first, on_axis.last);
      }
    }
  }

 private:
  static constexpr S kInfinity = std::numeric_limits<S>::infinity();

  // Cells on one axis in which the ray is, numbered in the order in which it enters them.
  struct Axis {
    bool backwards;
    int32_t first, last;
    S next_near;  // where the ray enters the cell after `last`; infinity if there is none
    S step = 0;   // for PlantedBug::kGridAccumulatedT
  };

  // Returns the padded interval of the ray at the border before cell `cell`, numbered in the order of the ray.
  Interval<S> crossing(int axis, int32_t cell) const {
    const int32_t number = axes_[axis].backwards ? layout_.count(axis) - cell : cell;
    Aabb<S> border = {{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity}};
    border.min[axis] = border.max[axis] = layout_.border(axis, number);
    return slabs_.interval(border, magnitude_);
  }

  int32_t in_order(int axis, int32_t cell) const {
    return axes_[axis].backwards ? layout_.count(axis) - 1 - cell : cell;
  }

  // Finds the cells on `axis` in which the ray is at near_.
  void start(int axis) {
    Axis& on_axis = axes_[axis];
    // The slab test takes the sign of a component even if the component is zero.
    on_axis.backwards = std::signbit(slabs_.direction()[axis]) && !planted(PlantedBug::kGridSignedDirection);
    const int32_t last = layout_.count(axis) - 1;
    const double at = double{slabs_.origin()[axis]} + double{near_} * double{slabs_.direction()[axis]};
    int32_t cell = in_order(axis, layout_.cell_of(axis, static_cast<S>(at)));
    while (cell > 0 && crossing(axis, cell).far >= near_) --cell;
    while (cell < last && crossing(axis, cell + 1).far < near_) ++cell;
    on_axis.first = on_axis.last = cell;
    while (on_axis.last < last && crossing(axis, on_axis.last + 1).near <= near_) ++on_axis.last;
    set_next(axis);
    if (planted(PlantedBug::kGridAccumulatedT) && on_axis.last + 1 < last)
      on_axis.step = crossing(axis, on_axis.last + 2).near - on_axis.next_near;
  }

  void advance(int axis) {
    Axis& on_axis = axes_[axis];
    const S entered = on_axis.next_near;
    ++on_axis.last;
    while (on_axis.first < on_axis.last && crossing(axis, on_axis.first + 1).far < near_) ++on_axis.first;
    set_next(axis);
    if (planted(PlantedBug::kGridAccumulatedT) && on_axis.next_near < kInfinity)
      on_axis.next_near = entered + on_axis.step;
  }

  void set_next(int axis) {
    Axis& on_axis = axes_[axis];
    const bool another = on_axis.last + 1 < layout_.count(axis);
    on_axis.next_near = another ? crossing(axis, on_axis.last + 1).near : kInfinity;
  }

  // Sets the range of cells() on `axis` to cells that are numbered in the order of the ray.
  void set_cells(int axis, int32_t first, int32_t last) {
    cells_.first[axis] = in_order(axis, first);
    cells_.last[axis] = in_order(axis, last);
    if (axes_[axis].backwards) std::swap(cells_.first[axis], cells_.last[axis]);
  }

  const GridLayout<S>& layout_;
  const SlabRay<S>& slabs_;
  S magnitude_;
  S near_ = 0, far_ = 0;
  bool done_ = true;
  std::array<Axis, 3> axes_;
  GridCells cells_;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_GRID_GRID_WALK_H_
