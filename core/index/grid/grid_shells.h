// Shells of cells around a point: shell r has the cells that are r cells away from the point's cell on some axis and no
// farther on any other.
#ifndef LOCUS_CORE_INDEX_GRID_GRID_SHELLS_H_
#define LOCUS_CORE_INDEX_GRID_GRID_SHELLS_H_

#include <algorithm>

#include "absl/container/inlined_vector.h"
#include "core/index/grid/grid_layout.h"

namespace locus {

// Cells of a shell on one side of it, and a lower bound of the squared distances of their boxes.
struct GridFace {
  GridCells cells;
  double squared_distance;
};

// One object per visit. Borrows the layout.
template <class S>
class GridShells {
 public:
  // If the point is outside the grid, the shells are around the cell nearest to it.
  GridShells(const GridLayout<S>& layout, const Vec3d& point) : layout_(layout), point_(point) {
    for (int axis = 0; axis < 3; ++axis) center_[axis] = layout.cell_of(axis, static_cast<S>(point[axis]));
  }

  // Returns the faces of the next shell that lie in the grid; none after the last shell. If all faces of a shell are
  // beyond a distance, so are those of later shells.
  absl::InlinedVector<GridFace, 6> next() {
    absl::InlinedVector<GridFace, 6> faces;
    if (radius_ == 0) {
      faces.push_back({{center_, center_}, 0});
    } else {
      for (int axis = 0; axis < 3; ++axis) {
        add_face(axis, center_[axis] - radius_, faces);
        add_face(axis, center_[axis] + radius_, faces);
      }
    }
    ++radius_;
    return faces;
  }

 private:
  // Adds the cells at `cell` on `axis`. The edges and corners of the shell are in the faces of the lowest axis.
  void add_face(int axis, int32_t cell, absl::InlinedVector<GridFace, 6>& faces) const {
    if (cell < 0 || cell >= layout_.count(axis)) return;
    GridFace face;
    for (int other = 0; other < 3; ++other) {
      const int32_t reach = other < axis ? radius_ - 1 : radius_;
      face.cells.first[other] = std::max(center_[other] - reach, 0);
      face.cells.last[other] = std::min(center_[other] + reach, layout_.count(other) - 1);
    }
    face.cells.first[axis] = face.cells.last[axis] = cell;
    const double low = double{layout_.border(axis, cell)}, high = double{layout_.border(axis, cell + 1)};
    const double gap = std::max({low - point_[axis], point_[axis] - high, 0.0});
    face.squared_distance = gap * gap;
    faces.push_back(face);
  }

  const GridLayout<S>& layout_;
  Vec3d point_;
  std::array<int32_t, 3> center_;
  int32_t radius_ = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_GRID_GRID_SHELLS_H_
