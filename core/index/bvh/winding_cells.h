// Cells over the bounds of a closed mesh, with the winding number of the mesh around all points of each clear cell. A
// cell is clear if it overlaps the bounds of no triangle and its winding number is stored (see kMaxSets). A point in a
// clear cell needs no search. From any other point, the search along a half line can end in the next clear cell,
// because the winding number of this cell already includes the crossings beyond it.
//
// Proof. Cells are intervals of coordinates on each axis, so a clear cell is a box without a point of the surface, and
// the winding number is the same around all its points. Two clear cells with a common side have the same winding
// number. Let a half line from p reach a point q in a clear cell. The winding number around p is the winding number
// around q plus the sum of the crossings between p and q: see core/geometry/point_in_mesh.h. If a triangle may cross
// the line, the projection of its bounds along the line contains the line, so on the two other axes the bounds overlap
// the intervals of the clear cell. Since the bounds do not overlap the cell, they lie completely before or completely
// beyond the cell along the line: before the cell if the bounds begin before q, else beyond the cell.
//
// Threads: immutable after build(); every member may run concurrently.
// Invariants: a cell that overlaps the bounds of a triangle is not clear; the end of a way (WindingWay) lies in a clear
// cell or outside the mesh.
#ifndef LOCUS_CORE_INDEX_BVH_WINDING_CELLS_H_
#define LOCUS_CORE_INDEX_BVH_WINDING_CELLS_H_

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/geometry/point_in_mesh.h"
#include "core/index/bvh/triangle_bvh.h"

namespace locus {

// Way of a search for the winding number around a point: the part of a half line that must be searched for crossings.
struct WindingWay {
  bool is_known = false;  // no search is needed: `winding` is the winding number around the point itself
  int winding = 0;        // winding number around the end of the way
  HalfLine line;          // half line to search
  float end = 0;          // coordinate on line.axis where the search ends; infinite if that is outside the mesh

  // Returns the way along a whole half line: the search ends outside the mesh, where the winding number is 0.
  static WindingWay out(HalfLine line) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    return {false, 0, line, line.descending ? -kInfinity : kInfinity};
  }
};

class WindingCells {
 public:
  // Makes an object without cells: every way leads out of the mesh.
  WindingCells() = default;
  // Makes the cells of a closed mesh: about four cells for each triangle, at most 2^22 cells, one byte for each cell.
  // O(n); up to 9 bytes of temporary memory for each cell.
  static WindingCells build(const TriangleBvh& tree);

  // Returns where the search from `point` can end: at `point` itself if it is outside the bounds of the mesh or in a
  // clear cell, otherwise in a clear cell near `point` or outside the mesh. `tree` must be the tree that was passed to
  // build(). O(1).
  WindingWay way_from(const TriangleBvh& tree, const Vec3d& point) const;

  // Returns the size in bytes of the memory allocated by this object; sizeof(WindingCells) is not included.
  size_t bytes() const;

 private:
  static constexpr uint32_t kMaxCells = 1u << 22, kMaxCellsPerAxis = 1024;
  static constexpr uint32_t kCellsPerTriangle = 4;
  // Maximum number of connected sets of clear cells whose winding number is computed. The cells of further sets count
  // as not clear. This bounds the time of a build.
  static constexpr uint32_t kMaxSets = 1024;

  // A cell is one byte. Values up to kMaxWinding - kMinWinding: a clear cell; the value is its winding number minus
  // kMinWinding. Values from kFirstWay to kNoWay - 1: a cell with a way to a clear cell or out of the bounds; the value
  // is kFirstWay + direction * kMaxSteps + (number of steps to the end of the way) - 1, where `direction` is the axis,
  // plus 3 if the way descends. kNoWay: any other cell. kUnset occurs only during a build.
  static constexpr int kMinWinding = -63, kMaxWinding = 63, kMaxSteps = 16;
  static constexpr uint8_t kFirstWay = 128, kNoWay = kFirstWay + 6 * kMaxSteps, kUnset = 255;

  // Division of one axis into cells. cell() never decreases if the coordinate increases, so each cell is an interval.
  struct Axis {
    double low = 0, size = 0, cells_a_unit = 0;
    uint32_t count = 1;
    uint32_t stride = 0;
    std::vector<float> inside = {0};  // for each cell, a coordinate in it

    // Returns the cell that contains `coordinate`. Precondition: `coordinate` is within the bounds of the mesh.
    uint32_t cell(double coordinate) const {
      return std::min(static_cast<uint32_t>((coordinate - low) * cells_a_unit), count - 1);
    }
  };
  using Cell = std::array<uint32_t, 3>;

  static bool is_clear(uint8_t cell) { return cell < kFirstWay; }
  uint32_t size() const { return axes_[0].count * axes_[1].count * axes_[2].count; }
  uint32_t index_of(const Cell& cell) const {
    return cell[0] * axes_[0].stride + cell[1] * axes_[1].stride + cell[2] * axes_[2].stride;
  }
  uint32_t coordinate_of(uint32_t index, int axis) const { return index / axes_[axis].stride % axes_[axis].count; }
  // Returns a point in a cell.
  Vec3d inside(uint32_t index) const;

  // Divides each axis into cells of about equal size.
  void divide(const Aabbf& bounds, size_t triangles);
  static Axis divided(double low, double high, uint32_t count);
  // Sets each cell to kNoWay if it overlaps the bounds of a triangle, otherwise to kUnset.
  void mark(const TriangleBvh& tree);
  // Sets the winding numbers of clear cells.
  void set_windings(const TriangleBvh& tree);
  // Sets `first` to `value`, and also each kUnset cell that is connected to `first` by a chain of kUnset cells with
  // common sides.
  void fill(uint32_t first, uint8_t value);
  // Sets the ways from cells that are not clear.
  void set_ways();
  // Verifies the ways, and the winding numbers of some cells, in debug builds.
  void check_invariants(const TriangleBvh& tree) const;

  std::array<Axis, 3> axes_;
  std::vector<uint8_t> cells_;  // empty in an object without cells
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_WINDING_CELLS_H_
