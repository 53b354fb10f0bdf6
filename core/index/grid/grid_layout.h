// Cells of a finite grid: the borders between them, the cells that a box touches, and their order in memory. Immutable;
// any thread.
#ifndef LOCUS_CORE_INDEX_GRID_GRID_LAYOUT_H_
#define LOCUS_CORE_INDEX_GRID_GRID_LAYOUT_H_

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/base/limits.h"
#include "core/base/planted_bug.h"
#include "core/geometry/aabb.h"

namespace locus {

// Order of the cells in memory; on each axis their number is rounded up to a power of two.
enum class GridOrder : uint8_t {
  kXMajor,  // x varies fastest, then y, then z
  kMorton,  // the bits of x, y and z take turns, so that cells near each other in space are near in memory
};

// Cells from `first` to `last`, both included on each axis.
struct GridCells {
  std::array<int32_t, 3> first;
  std::array<int32_t, 3> last;

  uint64_t count() const {
    uint64_t count = 1;
    for (int axis = 0; axis < 3; ++axis) count *= static_cast<uint64_t>(std::max(last[axis] - first[axis] + 1, 0));
    return count;
  }
};

// Invariant: the borders of an axis ascend from bounds().min to bounds().max, and cell i is the closed range from
// border i to border i + 1. cell_of() is monotone, and cell_of(x) contains x if the grid does.
template <class S>
class GridLayout {
 public:
  GridLayout() = default;

  // Divides `bounds`, which are not empty, into cubes with sides of `cell_size` > 0, or a power of two times as long if
  // there would be more than limits::kMaxGridCells cells.
  GridLayout(const Aabb<S>& bounds, double cell_size, GridOrder order) : bounds_(bounds) {
    const Vec3d extent = to_double(bounds).extent();
    std::array<int, 3> bits = {};
    do {
      for (int axis = 0; axis < 3; ++axis) {
        const double count = std::clamp(std::ceil(extent[axis] / cell_size), 1.0, 2.0 * limits::kMaxGridCells);
        counts_[axis] = static_cast<int32_t>(count);
        bits[axis] = std::bit_width(static_cast<uint32_t>(counts_[axis]) - 1);
      }
      per_length_ = 1 / cell_size;
      cell_size *= 2;
    } while (bits[0] + bits[1] + bits[2] > static_cast<int>(std::bit_width(limits::kMaxGridCells)) - 1);
    table_size_ = size_t{1} << (bits[0] + bits[1] + bits[2]);
    for (int axis = 0; axis < 3; ++axis) make_borders(axis);
    order_cells(order, bits);
  }

  const Aabb<S>& bounds() const { return bounds_; }
  int32_t count(int axis) const { return counts_[axis]; }
  // Returns the number of entries of a table of all cells; not all of them are used.
  size_t table_size() const { return table_size_; }
  S border(int axis, int32_t number) const { return borders_[axis][static_cast<size_t>(number)]; }

  // Returns the last cell that contains x or, if x lies outside the grid or is not a number, the cell nearest to it.
  int32_t cell_of(int axis, S x) const {
    if (!(x > bounds_.min[axis])) return 0;
    if (x >= bounds_.max[axis]) return counts_[axis] - 1;
    const double guess = (double{x} - double{bounds_.min[axis]}) * per_length_;
    int32_t cell = std::min(static_cast<int32_t>(std::min(guess, 2.0 * limits::kMaxGridCells)), counts_[axis] - 1);
    while (x < border(axis, cell)) --cell;
    while (cell + 1 < counts_[axis] && x >= border(axis, cell + 1)) ++cell;
    return cell;
  }

  // Returns the cells for a box: boxes that share a point have common cells. The box need not lie within the grid.
  GridCells cells_of(const Aabb<S>& box) const {
    GridCells cells;
    for (int axis = 0; axis < 3; ++axis) {
      cells.first[axis] = cell_of(axis, box.min[axis]);
      cells.last[axis] = cell_of(axis, box.max[axis]);
    }
    return cells;
  }

  // Returns the index of a cell in a table of all cells.
  size_t index(int32_t x, int32_t y, int32_t z) const {
    return offsets_[0][static_cast<size_t>(x)] + offsets_[1][static_cast<size_t>(y)] +
           offsets_[2][static_cast<size_t>(z)];
  }

  Aabb<S> box_of(int32_t x, int32_t y, int32_t z) const {
    return {{border(0, x), border(1, y), border(2, z)}, {border(0, x + 1), border(1, y + 1), border(2, z + 1)}};
  }

 private:
  void make_borders(int axis) {
    const double low = double{bounds_.min[axis]};
    for (int32_t i = 0; i < counts_[axis]; ++i)
      borders_[axis].push_back(std::min(static_cast<S>(low + i / per_length_), bounds_.max[axis]));
    borders_[axis].push_back(bounds_.max[axis]);
  }

  // Computes the part that each coordinate contributes to index(). Source of the order by turns: Morton, A Computer
  // Oriented Geodetic Data Base and a New Technique in File Sequencing, 1966.
  void order_cells(GridOrder order, const std::array<int, 3>& bits) {
    std::array<std::vector<int>, 3> positions;  // of the bits of each coordinate in the index
    int next = 0;
    if (order == GridOrder::kXMajor) {
      for (int axis = 0; axis < 3; ++axis)
        for (int bit = 0; bit < bits[axis]; ++bit) positions[axis].push_back(next++);
    } else {
      for (int bit = 0; bit < *std::max_element(bits.begin(), bits.end()); ++bit)
        for (int axis = 0; axis < 3; ++axis)
          if (bit < bits[axis]) positions[axis].push_back(next++);
    }
    for (int axis = 0; axis < 3; ++axis) {
      for (uint32_t cell = 0; cell < static_cast<uint32_t>(counts_[axis]); ++cell) {
        uint32_t offset = 0;
        for (int bit = 0; bit < bits[axis]; ++bit) offset |= ((cell >> bit) & 1) << positions[axis][bit];
        offsets_[axis].push_back(offset);
      }
    }
  }

  Aabb<S> bounds_;
  std::array<int32_t, 3> counts_ = {};
  double per_length_ = 1;  // cells per unit of length
  size_t table_size_ = 0;
  std::array<std::vector<S>, 3> borders_;
  std::array<std::vector<uint32_t>, 3> offsets_;
};

// Returns a cell size with which about as many cells as values divide `bounds`, but at least `mean_extent`, the mean
// longest side of the bounds of the values. Axes on which the bounds are narrower than a cell are not divided.
inline double chosen_cell_size(const Aabbd& bounds, size_t values, double mean_extent) {
  const Vec3d extent = bounds.extent();
  std::array<bool, 3> divided = {extent.x > 0, extent.y > 0, extent.z > 0};
  for (;;) {
    double log_volume = 0;
    int axes = 0;
    for (int axis = 0; axis < 3; ++axis) {
      if (!divided[axis]) continue;
      log_volume += std::log(extent[axis]);
      ++axes;
    }
    if (axes == 0) return mean_extent > 0 ? mean_extent : 1;
    const double size = std::exp((log_volume - std::log(static_cast<double>(std::max<size_t>(values, 1)))) / axes);
    bool dropped = false;
    for (int axis = 0; axis < 3; ++axis) {
      if (!divided[axis] || extent[axis] >= size || axes == 1) continue;
      divided[axis] = false;
      dropped = true;
    }
    if (!dropped) return std::max(size, mean_extent);
  }
}

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_GRID_GRID_LAYOUT_H_
