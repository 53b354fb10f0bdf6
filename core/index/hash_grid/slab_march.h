// Where a ray goes through one level of the hash grid: slabs of bricks across the ray's dominant axis, from near to
// far, each with the rectangle of bricks whose values the ray can meet in it. Immutable; any thread.
//
// Every figure is computed from the slab's integer index, never accumulated along the ray, and widened by how far
// values reach out of their bricks, by the pad of the slab test and by the rounding of the figures themselves. So a
// value that passes the slab test is always filed in a brick named here, and each brick is named at most once. Compare
// Amanatides and Woo, A Fast Voxel Traversal Algorithm for Ray Tracing, 1987, whose accumulated steps lose cells on
// long rays.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_SLAB_MARCH_H_
#define LOCUS_CORE_INDEX_HASH_GRID_SLAB_MARCH_H_

#include "core/geometry/ray.h"
#include "core/index/hash_grid/cell_key.h"

namespace locus::internal {

// What a march needs to know of a level.
struct LevelExtent {
  Aabbd bounds;      // around all its values; not empty
  double reach = 0;  // how far the bounds of any value extend from its position
  double cells_per_unit = 1;
};

class SlabMarch {
 public:
  struct Slab {
    double near;      // no value of this slab or a later one has a smaller near value
    KeyRange bricks;  // may be empty
  };

  // For the part of the ray up to `limit`, in the unit of the slab test.
  SlabMarch(const SlabRay<double>& ray, const LevelExtent& level, double limit);

  // How many slabs there are; 0 when the ray misses the level.
  int64_t slabs() const { return slabs_; }
  // About how many bricks they name, before `limit` falls. Infinite where the figures overflow: do not march then.
  double bricks() const { return bricks_; }
  // Slab number `n` from the near end; `limit` as above, possibly smaller by now.
  Slab slab(int64_t n, double limit) const;

  // One layer of cells within a slab, likewise: number 0 to 3 from the near end.
  struct Layer {
    double near;
    KeyRange cells;  // may be empty
  };
  Layer layer(int64_t n, int number, double limit) const;

 private:
  // The positions of values between two planes across the ray, which `index` times `edge` and one edge more name, that
  // the ray can meet up to `limit`; near as in Slab.
  struct Crossing {
    double near;
    Aabbd positions;  // may be empty
  };
  Crossing cross(double index, double edge, double limit) const;
  Vec3d point_at(double t) const { return origin_ + direction_ * t; }

  Vec3d origin_, direction_;
  Aabbd bounds_;
  double per_unit_;
  double slab_edge_;
  double margin_ = 0;  // around the ray, for positions
  Interval<double> part_{0, 0};
  int axis_ = 0;
  int64_t first_ = 0;
  int64_t step_ = 1;
  int64_t slabs_ = 0;
  double bricks_ = 0;
};

}  // namespace locus::internal

#endif  // LOCUS_CORE_INDEX_HASH_GRID_SLAB_MARCH_H_
