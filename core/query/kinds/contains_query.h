// Search for the objects and instances that contain a point. An instance with a closed mesh contains the points on
// the surface of the mesh, and the points around which the mesh has a nonzero winding number. With CONSERVATIVE, the
// bounds of an object, or of an instance with a closed mesh, must contain the point. Rows ascend by id. Free
// functions; any thread may call them with a QueryTask of its own.
#ifndef LOCUS_CORE_QUERY_KINDS_CONTAINS_QUERY_H_
#define LOCUS_CORE_QUERY_KINDS_CONTAINS_QUERY_H_

#include "core/query/kinds/overlap_query.h"

namespace locus {

// Answers one query for a point in world axes. Objects are searched as of `moment`, which the answer borrows; the
// memory of OverlapAnswer::objects belongs to `task` and is valid until the next query of the task. Cost: visits of the
// nodes and triangles between the point and the next clear cell of each mesh (winding_cells.h), and of the grid cells
// around the point.
OverlapAnswer run_contains(QueryTask& task, const SceneAtTime& moment, Vec3d point, const OverlapOptions& options,
                           const Filter& filter);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_CONTAINS_QUERY_H_
