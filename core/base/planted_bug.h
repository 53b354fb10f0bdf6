// Known bugs that tests can plant to prove that the suite would catch them. Outside the library built for those tests
// (LOCUS_PLANT_BUGS) planted() is constant false and costs nothing.
#ifndef LOCUS_CORE_BASE_PLANTED_BUG_H_
#define LOCUS_CORE_BASE_PLANTED_BUG_H_

namespace locus {

enum class PlantedBug {
  kNone,
  kDropCell,           // the grid forgets one occupied cell of a query's range
  kStrictTie,          // < for <= where a touching or equal hit decides
  kStaleSnapshot,      // a published snapshot keeps the objects of the revision before
  kGhostAfterMove,     // a move across a cell border leaves the object in its old cell
  kUnsignedCellIndex,  // cell indices truncate towards zero instead of flooring
  kRewindReach,        // between two ticks objects are looked for only where they were at the first
  kRewindFastBox,      // the way of an object that moved far leaves out its later, shorter moves of the tick
  kUnpaddedNear,       // the near side of the slab test of tree nodes goes without its pad
  kEdgeOnInDouble,     // triangles nearly edge-on are decided in double, like all others
  kGridBallMargin,     // float culls what balls reach without its error bound
  kNearestLimit,       // boxes as far as the farthest thing found near a point are left out
  kNearestTreePad,     // float decides distances to the boxes of triangles without its pad
  kWidePlacedBounds,   // bounds of placed triangles are grown by what float rounds by
  kPlacedBoundsAlone,  // balls and boxes meet placed bounds alone, not what rounding puts beside them
  // The ray kernels:
  kKernelEdgeBound,         // float decides edges without its error bound
  kKernelTBound,            // float decides t without its error bound
  kKernelTreePad,           // boxes of nodes go without their pad
  kKernelEdgeOn,            // triangles seen nearly edge-on are left out instead of decided in double
  kKernelFloatAxis,         // float chooses the axis of projection, ties and all
  kKernelWinding,           // rays backwards along their axis see triangles turned over
  kKernelCull,              // culling takes every triangle for one seen from its front
  kKernelLimit,             // a hit exactly at the limit is lost
  kKernelTie,               // of equal hits the highest number wins
  kKernelPruneEqual,        // boxes that start exactly at the best hit are left out
  kKernelRowTie,            // of hits as far as the last row kept the lowest number does not push it out
  kKernelHitAfterGivingUp,  // what a packet meets last answers a ray that it left undecided
  // The region kernels:
  kRegionReach,       // boxes of nodes are held against the ball without a pad
  kRegionInside,      // float decides what is inside the ball without its error bound
  kRegionBeyond,      // float parts ball and triangle by a plane without its error bound
  kRegionNear,        // float decides the distance to edges without its error bound
  kRegionPlane,       // float decides the distance to planes without its error bound
  kRegionWeight,      // float decides whether a foot lies inside without its error bound
  kRegionOwnBounds,   // the bounds of a triangle's own are forgotten
  kRegionFloor,       // squares and products that underflow are trusted
  kRegionHalf,        // half extents go without their error bound
  kRegionBoxPlane,    // float decides shadows on normals without their error bound
  kRegionEdgeScale,   // products of edges may underflow
  kRegionRange,       // coordinates of which products underflow are decided in float
  kRegionTurnedNode,  // boxes of nodes are held against a turned box without a pad
};

#ifdef LOCUS_PLANT_BUGS
inline PlantedBug planted_bug = PlantedBug::kNone;
inline bool planted(PlantedBug bug) { return planted_bug == bug; }
#else
constexpr bool planted(PlantedBug) { return false; }
#endif

}  // namespace locus

#endif  // LOCUS_CORE_BASE_PLANTED_BUG_H_
