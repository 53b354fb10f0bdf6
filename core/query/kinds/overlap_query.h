// Search for the objects, and the instances or their triangles, that overlap one ball, box, capsule or convex region.
// Rows ascend by id. Free functions; any thread may call them with a QueryTask of its own.
#ifndef LOCUS_CORE_QUERY_KINDS_OVERLAP_QUERY_H_
#define LOCUS_CORE_QUERY_KINDS_OVERLAP_QUERY_H_

#include "core/geometry/ball.h"
#include "core/geometry/capsule.h"
#include "core/geometry/convex_region.h"
#include "core/geometry/obb.h"
#include "core/query/kinds/lowest_rows.h"
#include "core/query/kinds/overlap_columns.h"
#include "core/query/kinds/query_task.h"

namespace locus {

// Answer one ball, box, capsule or region query, given in world axes. Objects are searched as of `moment`, which the
// answer borrows. The memory of OverlapAnswer::objects belongs to `task` and is valid until the next query of the task.
// Cost: visits of the nodes, cells and primitives that overlap the solid, and the sorting of the rows.
OverlapAnswer run_ball(QueryTask& task, const SceneAtTime& moment, const Balld& ball, const OverlapOptions& options,
                       const Filter& filter);
OverlapAnswer run_box(QueryTask& task, const SceneAtTime& moment, const Obbd& box, const OverlapOptions& options,
                      const Filter& filter);
OverlapAnswer run_capsule(QueryTask& task, const SceneAtTime& moment, const Capsule& capsule,
                          const OverlapOptions& options, const Filter& filter);

OverlapAnswer run_region(QueryTask& task, const SceneAtTime& moment, const ConvexRegion& region,
                         const OverlapOptions& options, const Filter& filter);

// Searches the objects that contain a point: `point` is a ball of radius 0. Adds a row for each compound to `rows`, and
// all other objects to task.found_objects().
void find_objects_around(QueryTask& task, const SceneAtTime& moment, const Balld& point, const OverlapOptions& options,
                         const Filter& filter, LowestRows& rows);

// Return the number of the triangle that is nearest to the ball's centre or to the capsule's inner segment, or into
// which the box reaches most deeply, among the triangles of the instance that the solid overlaps. Return the lowest
// number if several triangles are equally near, and kNoTriangle if the solid overlaps no triangle. `solid` is in world
// axes.
uint32_t nearest_overlapping(QueryTask& task, const Balld& solid, const Instance& instance);
uint32_t nearest_overlapping(QueryTask& task, const Capsule& solid, const Instance& instance);
uint32_t nearest_overlapping(QueryTask& task, const Obbd& solid, const Instance& instance);

// Return the region that run_ball(), run_box() or run_capsule() searches in the grid of objects.
// QueryTask::walk_regions() uses these regions.
GridRegion ball_region(const SceneAtTime& moment, const Balld& ball, const OverlapOptions& options);
GridRegion box_region(const SceneAtTime& moment, const Obbd& box, const OverlapOptions& options);
GridRegion capsule_region(const SceneAtTime& moment, const Capsule& capsule, const OverlapOptions& options);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_OVERLAP_QUERY_H_
