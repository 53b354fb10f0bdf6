// Oriented boxes and the overlap test of two of them. A box has a centre, half extents along its own axes, and the
// rotation of these axes. A box is closed: touching counts, and zero extents are legal. With the identity rotation a
// box is exactly axis-aligned. Plain data and pure functions; any thread.
#ifndef LOCUS_CORE_GEOMETRY_OBB_H_
#define LOCUS_CORE_GEOMETRY_OBB_H_

#include "core/geometry/aabb.h"
#include "core/geometry/rotation.h"

namespace locus {

template <class S>
struct Obb {
  Vec3<S> center;
  Vec3<S> half;       // >= 0
  Rotation rotation;  // rotates the box's own axes to the axes in which `center` is given
};

using Obbf = Obb<float>;
using Obbd = Obb<double>;

// Returns axis-aligned bounds in double. If the box is rotated, the bounds are grown by 2^-40 of the sum of the
// magnitudes of its centre and its extent.
template <class S>
Aabbd bounds_of(const Obb<S>& box);

// Returns whether the boxes share a point: separating axis test over 15 axes. Two axis-aligned boxes are compared
// without tolerance, so that the test for touching is exact if the sums are exact. If at least one box is rotated, the
// boxes count as touching if their gap is smaller than about 2^-49 of the sum of the magnitudes of their offset and
// their half extents. Both boxes are projected on the same rounded axis. So the rounding error of an axis, which is
// large for nearly parallel edges, can only make that axis fail to separate the boxes; it never separates boxes that
// overlap. Source: Gottschalk, Lin, Manocha, OBBTree: A Hierarchical Structure for Rapid Interference Detection, 1996.
bool boxes_overlap(const Obbd& a, const Obbd& b);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_OBB_H_
