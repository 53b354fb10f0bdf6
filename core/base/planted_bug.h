// Mutation testing: known bugs that a test switches on to prove that the test suite detects them. Only the library that
// is built for those tests defines LOCUS_PLANT_BUGS; in all other builds planted() is a constant false and costs
// nothing. Set `planted_bug` only while no other thread runs, because it is not synchronised.
#ifndef LOCUS_CORE_BASE_PLANTED_BUG_H_
#define LOCUS_CORE_BASE_PLANTED_BUG_H_

namespace locus {

enum class PlantedBug {
  kNone,
  kDropCell,           // the grid skips the first row of cells in each brick that a query scans
  kStrictTie,          // tests that include equality (touching, equal distances) compare with < instead of <=
  kStaleSnapshot,      // a published snapshot has the objects of the previous revision
  kGhostAfterMove,     // a move across a cell border leaves the object in its old cell
  kHalfGroup,          // the first message of a batch of several messages is published as a revision of its own
  kExpiryLate,         // an object expires one tick too late
  kExpiryUnmoved,      // a batch that only moves objects removes no expired objects
  kLeaseOfFirst,       // an object that another writer inserts again still belongs to the lease of the first writer
  kLeaseTwice,         // a lease that was renewed, or ended and begun again, still ends at its old time
  kUnsignedCellIndex,  // cell indices are truncated towards zero, not rounded down
  kStalePlacedBounds,  // an instance that moves keeps the bounds that it had at its old place
  kPastInstances,      // queries about the past see the instances of the latest revision
  kRewindReach,        // a query at a time between two ticks searches the grid without the displacement bound
  kRewindFastBox,      // after a far move of an object, its shorter moves later in the same tick are not recorded
  kUnpaddedNear,       // the slab test of tree nodes does not pad the near side
  kEdgeOnInDouble,     // nearly edge-on triangles are tested only in double, like all other triangles
  kSparseBrickBounds,  // the bounds of a level of wider cells contain only the centres of its bricks
  kGridBallMargin,     // the float culling of ball queries in the grid omits the error bound
  kGridInsideMargin,   // the grid decides without an error bound which positions are inside a box or ball
  kNearestLimit,       // a nearest query also prunes boxes at exactly the distance of its farthest result
  kNearestTreePad,     // distances to boxes of triangles are compared in float without the pad
  kWidePlacedBounds,   // world bounds of an instance's triangles are grown by a rounding error of float, not double
  kPlacedBoundsAlone,  // CONSERVATIVE overlap queries lose exact hits outside a triangle's world bounds
  kCapsuleCap,         // a capsule's inner segment is shortened by the radius at both ends
  kEndlessCapsule,     // a capsule's inner segment is a thousand times as long
  kSweepStart,         // a sweep does not find a primitive that the mover touches at the start
  kSweepLineRadius,    // a sweep misses a triangle within the mover's radius beside the path of the mover's centre
  kSweepLineAxis,      // a sweep misses a triangle reached by the inner segment, but not the centre, of the mover
  kSweepLineEpsilon,   // a sweep misses, because of rounding, a triangle that the side of the mover just touches
  kSweepPassed,        // AtStart::kPass also ignores triangles within the diameter of the mover, not only its radius
  kPairBothSides,      // a pair of objects is reported twice, once for each object
  kPairCullExtent,     // the cull of pairs ignores the extent of the first object
  kRegionBrickReach,   // a brick is within a plane of a region if its centre is
  kCellBeyond,         // a cell of free space also has planes for primitives beyond its other planes
  kMatrixRow,          // the left and right planes of a view are computed from the wrong row of the matrix
  kOwnGroupBlocks,     // the group of a viewer blocks its sight
  kFilterRayMeshes,    // rays ignore the filters for instances
  kFilterFirstGroup,   // only the first of the groups to which a query is restricted is compared
  kFilterTagMask,      // all bits of tags are compared, whatever the mask is
  kFilterLabels,       // the filters by ids, tag and wanted groups accept everything
  kClosedEdge,         // an edge includes both of its ends when crossings of a mesh are counted
  kCrossingInDouble,   // signs of crossings are taken from double even if double cannot decide them
  kCrossingMirror,     // a descending half line counts crossings with the sign of an ascending one
  kCellAtMax,          // on each axis, a triangle does not mark the last of several cells that it overlaps
  kWayShort,           // a search along a half line ends in the cell of its start, not in the cell where it should end
  kHalfLineRounding,   // boxes are compared with the point rounded to the nearest float
  kHalfLineStart,      // a half line misses a box that ends exactly at the start of the half line
  kPartMask,           // the layers of a compound's part are ignored
  // The ray kernels:
  kKernelEdgeBound,   // the signs of edge functions are computed in float without an error bound
  kKernelTBound,      // t is compared with the limit in float without an error bound
  kKernelTreePad,     // boxes of nodes are not padded
  kKernelEdgeOn,      // triangles that may be edge-on according to float are dropped instead of tested in double
  kKernelFloatAxis,   // the axis of projection is chosen in float, even if two components are equal in float
  kKernelWinding,     // front and back are exchanged for rays with a negative direction along the projection axis
  kKernelCull,        // culling treats every triangle as front-facing
  kKernelLimit,       // a hit exactly at the limit is lost
  kKernelTie,         // among equal hits the highest triangle number wins
  kKernelPruneEqual,  // boxes that the ray enters exactly at its best hit are pruned
  // In a query for all hits, a hit does not replace the highest stored row if the hit has the same t as this row and a
  // lower triangle number.
  kKernelRowTie,
  kKernelHitAfterGivingUp,  // an undecided ray of a packet still records later hits
  kKernelBeamMiddle,        // a beam excludes the triangles that its middle ray misses
  // The region kernels:
  kRegionReach,       // boxes of nodes are tested against the ball without a pad
  kRegionInside,      // vertices are tested against the ball in float without an error bound
  kRegionBeyond,      // the test for a plane that separates a triangle from the ball omits the error bound
  kRegionNear,        // distances to edges are compared with the radius in float without an error bound
  kRegionPlane,       // distances to planes are compared with the radius in float without an error bound
  kRegionWeight,      // the test whether the ball's centre projects into a triangle omits the error bound
  kRegionOwnBounds,   // error bounds that depend on the size of a single triangle are zero
  kRegionFloor,       // squares and products that may underflow are compared without the pad for underflow
  kRegionHalf,        // half extents are used without their error bound
  kRegionBoxPlane,    // projections on normals are compared in float without their error bound
  kRegionEdgeScale,   // edges are not scaled up, so that products of their components may underflow
  kRegionRange,       // boxes and blocks so small that products of coordinates underflow are tested in float
  kRegionTurnedNode,  // boxes of nodes are tested against a rotated box without a pad
  // Trees that divide space by planes across the axes:
  kPlaneTreePassedTwice,    // a value that lies in several leaves is passed from each of them
  kPlaneTreeReferenceLeft,  // a removed value stays in all of its leaves but one
  kPlaneTreeFixedBounds,    // a value that is inserted outside the bounds of the tree does not widen them
  // The kd tree:
  kKdLowerStrict,    // a region that begins exactly at a dividing plane is not searched below the plane
  kKdAxisByTurns,    // a node divides values on any axis, but keeps the axis of its level
  kKdRayFromInside,  // a ray that starts outside the bounds of the tree finds nothing
  kKdRayUnpadded,    // regions are not padded for their own coordinates when they are tested with rays
  kKdRayToBorder,    // a ray is followed beyond its limit
  kKdNearestStrict,  // a nearest query does not search regions exactly as far as its limit
  kKdPointsStrict,   // boxes and balls of points do not search the side of a plane that they just touch
  // Indexes that divide space by planes, and trees of balls:
  kPaddedRayThin,   // rays are compared with planes and balls without the pad of the slab test
  kBspPassedTwice,  // a value that lies in several leaves is passed in each of them
  kBspOnPlane,      // a value or region that only touches a plane is on one side of it
  kBspRemoveOnce,   // remove() removes a value from one of its leaves only
  kBspEyeBehind,    // the order from front to back is that of an eye in front of every plane
  kSphereCenters,   // a ball contains the centres of the values' bounds, but not the bounds
  // The octree:
  kOctreeLowerStrict,    // a region that begins exactly at a dividing plane is not searched below the plane
  kOctreeRayFromInside,  // a ray that starts outside the bounds of the tree finds nothing
  kOctreeRayUnpadded,    // planes are not padded for the coordinates of the tree when they are tested with rays
  kOctreeRayToBorder,    // a ray is followed beyond its limit
  kOctreeNearestStrict,  // a nearest query does not search parts exactly as far as its limit
  // The finite grid:
  kGridForgetsMinimum,   // cells of a region are counted from zero, not from the minimum corner of the grid
  kGridWrongAxis,        // a ray looks up its cells with y in place of z
  kGridSignedDirection,  // cells are ordered for rays as if all components of the direction were positive
  kGridClippedToCell,   // a ray tests a value only within the interval of the ray in the value's cell, without a margin
  kGridAccumulatedT,    // the distances at which a ray enters cells are accumulated from cell to cell
  kGridDiagonalStep,    // a ray that crosses several borders at once skips the cells that it only touches
  kGridRayToBorder,     // a ray is followed beyond its limit
  kGridRayFromInside,   // a ray that starts outside the bounds of the grid finds nothing in the cells
  kGridPassedTwice,     // a value that lies in several cells is passed from each of them
  kGridReferenceLeft,   // a removed value stays in all of its cells but one
  kGridClampedOutside,  // values outside the bounds of the grid lie in the nearest cells
  kGridNearestStrict,   // a nearest query does not search cells exactly as far as its limit
  // Access control:
  kRightLeftOut,         // a grant of any right to a scene grants every right to it
  kSceneLeftOut,         // a grant for some scenes grants its rights to every scene
  kUpdateIsAdmin,        // the right to update includes the right to administer
  kGlobTooWide,          // a pattern matches every text that begins with a match of the pattern
  kTokenByPrefix,        // only the beginning of a token, its id, is compared
  kTokenNeverExpires,    // the time at which a token expires is ignored
  kRevokedTokenStays,    // the streams of a revoked token are still valid
  kReloadUnnoticed,      // a reload changes the rules, but not their generation
  kJwtNeverExpires,      // the claim exp is ignored
  kJwtForAnyone,         // the claim aud is ignored
  kJwtWithoutAlgorithm,  // a JWT whose algorithm is `none` needs no signature
  kJwtAnySignature,      // the signature is not compared
  kJwtKeyOfAnotherKind,  // a key verifies signatures of any algorithm
  kUserFromAfar,         // the Unix user of a peer is also accepted on connections that are not local
  // The cluster, and the simulated engine that its tests use:
  kSilenceWithoutBeats,  // silence of members is also counted while the own beats fail
  kLeaseUnchecked,       // a lease counts as living although it has expired, as after a pause
  kLeaseFromAnswer,      // the lease is counted from the answer to a beat, not from before it was sent
  kMarkAnyBeat,          // the engine marks a member as dead although it has beaten since
  kTakeOverAnyToken,     // the engine lets a member take over a scene although its token has changed
  kHandOverAnyToken,     // the engine lets a former leader hand a scene over
  kHandedOverLeadsOn,    // the lease of a scene that is handed over is not stopped
  kDeadLeadsOn,          // a member that was declared dead keeps its lease
  // The log in PostgreSQL:
  kAppendWithoutToken,   // an append does not name the token of its scene
  kResolvedByPlainRead,  // whether an append was written is asked by a read that does not wait for the standbys
  kEngineHostKept,       // after a lost connection the same host is tried first
  kChainNotCompared,     // the running checksums of records are not compared
  kWarningIgnored,       // a commit whose wait for the standbys was cancelled counts as acknowledged
  kLostAppendKept,       // the records of a failed append are not removed before the next append
  // The nearest kernels:
  kNearestError,      // bounds of distances to triangles are computed in float without an error bound
  kNearestPad,        // the distance between the point and the rounded point is ignored
  kNearestBoxLimit,   // squared distances to boxes are compared in float without a pad
  kNearestFloor,      // squares that may underflow are compared without the pad for underflow
  kNearestSlack,      // only triangles exactly as near as the nearest one are candidates
  kNearestOtherLane,  // the first candidate triangle of each block is dropped
  kNearestMeasure,    // distances to the planes of slivers are measured as for other triangles
  // The crossing kernels:
  kCrossingError,  // areas are compared with 0 in float without an error bound
  kCrossingPad,    // the difference between the point and the rounded point is ignored
  kCrossingNear,   // a triangle whose bounds contain the start of the half line counts as beyond the start
  kCrossingTop,    // a point at the height of a triangle's highest vertex is never on the surface
};

#ifdef LOCUS_PLANT_BUGS
inline PlantedBug planted_bug = PlantedBug::kNone;
inline bool planted(PlantedBug bug) { return planted_bug == bug; }
#else
constexpr bool planted(PlantedBug) { return false; }
#endif

}  // namespace locus

#endif  // LOCUS_CORE_BASE_PLANTED_BUG_H_
