// What is nearest to one point in a snapshot: instances, or their triangles, and objects, ascending by (distance, id,
// triangle).
//
// A distance is measured in double and world axes, from the point to the stored solid or to the triangle's corners as
// they are placed, is no less than that to the bounds that structures cull by, and is rounded to float once. Order and
// the greatest distance go by what was rounded, so that no structure can change an answer.
#ifndef LOCUS_CORE_QUERY_KINDS_NEAREST_QUERY_H_
#define LOCUS_CORE_QUERY_KINDS_NEAREST_QUERY_H_

#include <vector>

#include "core/query/kinds/hit.h"
#include "core/query/kinds/query_task.h"

namespace locus {

struct NearestRequest {
  Vec3d point;
  float max_distance;
  uint32_t count;       // rows at most
  bool every_triangle;  // a row a triangle, not only each instance's nearest
  Source source;
  Precision precision;
};

// The request of query `i` of a block.
NearestRequest nearest_request(const QueryBlock& block, const NearestColumns& nearest, size_t i);

// Rows: t is the distance, triangle that of the instance which is nearest. Cost: the nodes and cells within the
// distance of the last row, and O(log count) for each row kept.
// `moment` says when; the rows borrow it.
std::vector<Hit> run_nearest(QueryTask& task, const SceneAtTime& moment, const NearestRequest& request,
                             const Filter& filter);

// From the request's point to the nearest one of the row's object or triangle, or of its bounds with kConservative:
// zero inside a solid. Recomputed from the stored primitive.
Vec3d nearest_offset(const NearestRequest& request, const Hit& row);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_NEAREST_QUERY_H_
