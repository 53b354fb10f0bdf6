// Two oriented boxes share a point. Closed: touching counts.
#ifndef LOCUS_CORE_GEOMETRY_OBB_OBB_H_
#define LOCUS_CORE_GEOMETRY_OBB_OBB_H_

#include "core/geometry/obb.h"

namespace locus {

// Separating axis test over 15 axes. Two unturned boxes are compared without tolerance, so that touching is exact for
// exact sums; otherwise boxes closer than 2^-49 of the magnitudes count as touching. An axis is any vector along which
// both boxes are projected anew, so that the noise of nearly parallel edges picks a useless axis, never a false one.
// Source: Gottschalk, Lin, Manocha, OBBTree: A Hierarchical Structure for Rapid Interference Detection, 1996.
bool boxes_overlap(const Obbd& a, const Obbd& b);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_OBB_OBB_H_
