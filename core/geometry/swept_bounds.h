// Path of a mover's axis-aligned bounds, for tests against boxes. Immutable; cheap to copy; any thread.
#ifndef LOCUS_CORE_GEOMETRY_SWEPT_BOUNDS_H_
#define LOCUS_CORE_GEOMETRY_SWEPT_BOUNDS_H_

#include <algorithm>
#include <optional>

#include "core/geometry/mover.h"
#include "core/geometry/ray.h"

namespace locus {

// Ray from the mover's start, tested against boxes that are grown by the mover's extent on each axis. A mover that
// rests has no direction: its ray points along x, and only grown boxes that contain its start count as hit.
class SweptBounds {
 public:
  SweptBounds(const Mover& mover, double pad)
      : is_resting_(mover.way == Vec3d{}),
        extent_(extent_of(mover)),
        slabs_(Rayd{mover.start, is_resting_ ? Vec3d{1, 0, 0} : mover.way}, pad) {}

  // Returns the t, at least 0, at which the mover's bounds begin to overlap `box`, or nullopt if the bounds do not
  // overlap `box` at any t >= 0. A superset of a box never gives a larger t.
  std::optional<double> entry(const Aabbd& box) const {
    const Interval<double> interval = slabs_.interval(Aabbd{box.min - extent_, box.max + extent_});
    if (!(interval.near <= interval.far) || interval.far < 0) return std::nullopt;
    if (is_resting_) return interval.near <= 0 ? std::optional<double>(0) : std::nullopt;
    return std::max(interval.near, 0.0);
  }

  // Returns a ray for searching an index: an index that culls by this ray never culls a box that entry() accepts. `pad`
  // must be the pad that was passed to the constructor. For a mover that rests, the limit of the search must be 0.
  SlabRay<double> search_ray(double pad) const {
    return SlabRay<double>(Rayd{slabs_.origin(), slabs_.direction()}, pad, max_component(extent_));
  }

  bool is_resting() const { return is_resting_; }

 private:
  bool is_resting_;
  Vec3d extent_;
  SlabRay<double> slabs_;
};

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_SWEPT_BOUNDS_H_
