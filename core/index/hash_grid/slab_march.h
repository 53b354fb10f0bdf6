// March of a ray through one level of the hash grid. Lists slabs of bricks, from near to far. The slabs are
// perpendicular to the ray's dominant axis, the axis of the direction's largest component. Each slab has the rectangle
// of bricks whose values the ray can intersect in that slab. Immutable; any thread.
//
// The bounds of every slab are computed from its integer index, never accumulated along the ray. The bounds are widened
// by the largest extent of the level, the padding of the slab test and the rounding of the bounds themselves. Therefore
// a value that passes the slab test is always stored in a brick that a slab lists, and each brick is listed at most
// once. Compare Amanatides and Woo, A Fast Voxel Traversal Algorithm for Ray Tracing, 1987, whose accumulated steps
// miss cells on long rays.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_SLAB_MARCH_H_
#define LOCUS_CORE_INDEX_HASH_GRID_SLAB_MARCH_H_

#include "core/geometry/ray.h"
#include "core/index/hash_grid/cell_key.h"

namespace locus::internal {

// Geometry of a level of the grid, as input of queries.
struct LevelGeometry {
  Aabbd bounds;           // bounds of all values of the level; not empty
  double max_extent = 0;  // upper bound of the distance from a value's position to its bounds along any axis
  double cells_per_unit = 1;
};

class SlabMarch {
 public:
  struct Slab {
    // Lower bound of the t at which the ray enters the padded bounds of any value in this or a later slab.
    double near;
    KeyRange bricks;  // keys of the bricks; may be empty
  };

  // Prepares a march along the part of the ray with t <= `limit`, in units of the ray's direction.
  SlabMarch(const SlabRay<double>& ray, const LevelGeometry& level, double limit);

  // Returns the number of slabs; 0 if the ray misses the level.
  int64_t slabs() const { return slabs_; }
  // Returns the approximate number of brick keys that all slabs together list for the constructor's `limit`. Infinite
  // if a bound overflows: slab() and layer() must then not be called.
  double bricks() const { return bricks_; }
  // Returns slab `n`, counted from the near end, for the part of the ray with t <= `limit`. Preconditions: 0 <= n <
  // slabs(), and `limit` is at most the constructor's `limit`.
  Slab slab(int64_t n, double limit) const;

  // Layer of a slab: a part that is one cell thick. The four layers of a slab are counted from the near end.
  struct Layer {
    double near;
    KeyRange cells;  // keys of the cells whose values the ray may intersect in the layer; may be empty
  };
  Layer layer(int64_t n, int layer_index, double limit) const;

 private:
  // Part of the ray with t <= `limit` between the planes at `index` * `edge` and (`index` + 1) * `edge` on the dominant
  // axis. `near` has the same meaning as in Slab. `positions` covers the values that this part can intersect.
  struct Crossing {
    double near;
    Aabbd positions;  // bounds of the positions of these values; may be empty
  };
  Crossing cross(double index, double edge, double limit) const;
  Vec3d point_at(double t) const { return origin_ + direction_ * t; }

  Vec3d origin_, direction_;
  Aabbd bounds_;
  double per_unit_;
  double slab_edge_;
  double tube_radius_ = 0;  // upper bound of the distance from the ray to the position of a value that the ray hits
  Interval<double> part_{0, 0};
  int axis_ = 0;
  int64_t first_ = 0;
  int64_t step_ = 1;
  int64_t slabs_ = 0;
  double bricks_ = 0;
};

}  // namespace locus::internal

#endif  // LOCUS_CORE_INDEX_HASH_GRID_SLAB_MARCH_H_
