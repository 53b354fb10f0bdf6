// Oriented boxes: centre, half extents along the box's own axes, and the rotation from these axes. A box is closed;
// zero extents are legal. With the identity rotation it is exactly axis-aligned. Plain data; any thread.
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

// Returns axis-aligned bounds in double. If the box is rotated, they are grown by 2^-40 of the magnitudes of centre and
// extent.
template <class S>
Aabbd bounds_of(const Obb<S>& box);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_OBB_H_
