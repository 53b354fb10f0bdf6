// Nearest objects and instances, or triangles of instances, to one point in a snapshot, ascending by (distance, id,
// triangle). Free functions; any thread, with a QueryTask of its own.
//
// A distance is measured in double and world axes, from the point to the stored solid or to the placed corners of the
// triangle. It is never less than the distance to the bounds by which index structures cull, and is rounded to float
// once. Order and max_distance compare rounded distances, so that no index structure can change a result.
#ifndef LOCUS_CORE_QUERY_KINDS_NEAREST_QUERY_H_
#define LOCUS_CORE_QUERY_KINDS_NEAREST_QUERY_H_

#include <vector>

#include "core/query/kinds/hit.h"
#include "core/query/kinds/query_task.h"

namespace locus {

struct NearestRequest {
  Vec3d point;
  float max_distance;   // included
  uint32_t count;       // maximum number of rows, at least 1
  bool every_triangle;  // one row per triangle instead of one per instance, for its nearest triangle
  Source source;
  Precision precision;
};

// Returns the request of query `i` of a block.
NearestRequest nearest_request(const QueryBlock& block, const NearestColumns& nearest, size_t i);

// Returns the nearest rows in order: t is the distance, and triangle the nearest one of an instance. Objects are
// searched at `moment`, which the rows borrow. Cost: the nodes and cells within the distance of the last row, and O(log
// count) for each row kept.
std::vector<Hit> run_nearest(QueryTask& task, const SceneAtTime& moment, const NearestRequest& request,
                             const Filter& filter);

// Returns the vector from the request's point to the nearest point of the row's object or triangle, or of its bounds
// with kConservative. Zero inside a solid. Recomputed from the stored primitive.
Vec3d nearest_offset(const NearestRequest& request, const Hit& row);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_NEAREST_QUERY_H_
