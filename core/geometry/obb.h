// An oriented box, closed: centre, half extents along its own axes and the rotation from them. Zero extents are legal.
// The identity rotation makes it axis-aligned, exactly.
#ifndef LOCUS_CORE_GEOMETRY_OBB_H_
#define LOCUS_CORE_GEOMETRY_OBB_H_

#include "core/geometry/aabb.h"
#include "core/geometry/rotation.h"

namespace locus {

template <class S>
struct Obb {
  Vec3<S> center;
  Vec3<S> half;       // >= 0
  Rotation rotation;  // box axes to the axes of `center`
};

using Obbf = Obb<float>;
using Obbd = Obb<double>;

// Axis-aligned bounds in double, grown by 2^-40 of the magnitudes when the box is turned.
template <class S>
Aabbd bounds_of(const Obb<S>& box);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_OBB_H_
