// Mutation testing: known bugs that a test switches on to prove that the test suite detects them. Only the library that
// is built for those tests defines LOCUS_PLANT_BUGS; elsewhere planted() is a constant false and costs nothing. Set
// `planted_bug` while no other thread runs.
#ifndef LOCUS_CORE_BASE_PLANTED_BUG_H_
#define LOCUS_CORE_BASE_PLANTED_BUG_H_

namespace locus {

enum class PlantedBug {
  kNone,
  kDropCell,           // the grid skips one occupied cell in the range of a query
  kStrictTie,          // < instead of <= where touching or equal distances decide
  kStaleSnapshot,      // a published snapshot has the objects of the previous revision
  kGhostAfterMove,     // a move across a cell border leaves the object in its old cell
  kUnsignedCellIndex,  // cell indices are truncated towards zero, not rounded down
  kRewindReach,        // a query between two ticks searches only the positions at the first tick
  kRewindFastBox,      // the box of an object that moved far leaves out its later, shorter moves of the tick
  kUnpaddedNear,       // the slab test of tree nodes does not pad the near side
  kEdgeOnInDouble,     // nearly edge-on triangles are decided in double, like all others
  kGridBallMargin,     // the grid culls balls in float without the error bound
  kNearestLimit,       // a nearest query prunes boxes exactly as far as its farthest result
  kNearestTreePad,     // distances to boxes of triangles are compared in float without the pad
  kWidePlacedBounds,   // bounds of placed triangles are grown by the rounding of float
  kPlacedBoundsAlone,  // conservative ball and box queries test only placed bounds and lose exact hits outside these
  // The ray kernels:
  kKernelEdgeBound,         // edge functions are decided in float without the error bound
  kKernelTBound,            // t is decided in float without the error bound
  kKernelTreePad,           // boxes of nodes are not padded
  kKernelEdgeOn,            // nearly edge-on triangles are dropped instead of decided in double
  kKernelFloatAxis,         // the axis of projection is chosen in float, including ties
  kKernelWinding,           // rays in the negative direction of their axis see the reversed winding
  kKernelCull,              // culling treats every triangle as front-facing
  kKernelLimit,             // a hit exactly at the limit is lost
  kKernelTie,               // among equal hits the highest triangle number wins
  kKernelPruneEqual,        // boxes that begin exactly at the best hit are pruned
  kKernelRowTie,            // a hit as far as the last kept row does not replace it if its number is lower
  kKernelHitAfterGivingUp,  // the last hit of a packet is returned for a ray that the packet left undecided
  // The region kernels:
  kRegionReach,       // boxes of nodes are tested against the ball without a pad
  kRegionInside,      // points inside the ball are decided in float without the error bound
  kRegionBeyond,      // separation by a plane is decided in float without the error bound
  kRegionNear,        // distances to edges are decided in float without the error bound
  kRegionPlane,       // distances to planes are decided in float without the error bound
  kRegionWeight,      // a projected point inside the triangle is decided in float without the error bound
  kRegionOwnBounds,   // the test of the triangle's own bounds is skipped
  kRegionFloor,       // squares and products that underflow are trusted
  kRegionHalf,        // half extents are used without their error bound
  kRegionBoxPlane,    // projections on normals are decided in float without their error bound
  kRegionEdgeScale,   // products of edge components may underflow
  kRegionRange,       // coordinates whose products underflow are decided in float
  kRegionTurnedNode,  // boxes of nodes are tested against a rotated box without a pad
};

#ifdef LOCUS_PLANT_BUGS
inline PlantedBug planted_bug = PlantedBug::kNone;
inline bool planted(PlantedBug bug) { return planted_bug == bug; }
#else
constexpr bool planted(PlantedBug) { return false; }
#endif

}  // namespace locus

#endif  // LOCUS_CORE_BASE_PLANTED_BUG_H_
