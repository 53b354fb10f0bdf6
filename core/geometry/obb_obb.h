// Overlap test of two oriented boxes. Boxes are closed: touching counts. Pure functions; any thread.
#ifndef LOCUS_CORE_GEOMETRY_OBB_OBB_H_
#define LOCUS_CORE_GEOMETRY_OBB_OBB_H_

#include "core/geometry/obb.h"

namespace locus {

// Returns whether the boxes share a point: separating axis test over 15 axes. Two axis-aligned boxes are compared
// without tolerance, so that touching is exact if the sums are exact; otherwise boxes closer than 2^-49 of the
// magnitudes count as touching. Both boxes are projected on the same rounded axis. So the rounding error of an axis,
// which is large for nearly parallel edges, can only make that axis fail to separate the boxes; it never separates
// boxes that overlap. Source: Gottschalk, Lin, Manocha, OBBTree: A Hierarchical Structure for Rapid Interference
// Detection, 1996.
bool boxes_overlap(const Obbd& a, const Obbd& b);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_OBB_OBB_H_
