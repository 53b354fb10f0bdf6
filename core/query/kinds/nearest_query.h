// Search for the objects and instances, or triangles of instances, that are nearest to one point, ascending by
// (distance, id, triangle). Free functions; any thread may call them with a QueryTask of its own.
//
// An EXACT distance is computed in double and in world axes, from the point to the object's shape or to the triangle.
// The distance is never less than the distance to the bounds by which index structures cull, and it is rounded to float
// once. The order of rows and the comparison with max_distance use the rounded distance. A search through index
// structures and a test of all values therefore return the same rows.
#ifndef LOCUS_CORE_QUERY_KINDS_NEAREST_QUERY_H_
#define LOCUS_CORE_QUERY_KINDS_NEAREST_QUERY_H_

#include "absl/container/inlined_vector.h"
#include "core/query/kinds/hit.h"
#include "core/query/kinds/query_task.h"

namespace locus {

struct NearestRequest {
  Vec3d point;
  float max_distance;   // largest distance of a row, inclusive; may be +inf
  uint32_t count;       // maximum number of rows, at least 1
  bool every_triangle;  // true: one row per triangle; false: one row per instance, for its nearest triangle
  bool count_only;      // only the number of rows within max_distance is returned; `count` has no effect
  RowPosition after;    // only rows after this position are returned
  Source source;
  Precision precision;
};

// Returns the request of query `i` of a block. The positions of the query are relative to `origin`.
NearestRequest nearest_request(const QueryBlock& block, Vec3d origin, const NearestColumns& nearest, size_t i);

// Rows in the order of nearer() or, with count_only, only the number of rows.
struct NearestAnswer {
  absl::InlinedVector<Hit, 1> rows;
  uint64_t count = 0;
};

// Returns the nearest rows in the order of nearer(). Hit::t is the distance, and Hit::triangle the nearest triangle of
// an instance (with every_triangle, the row's triangle). Objects are searched as of `moment`, which the rows borrow.
// Cost: one visit for each node and cell that is at most as far away as the last returned row, and O(log count) for
// each inserted row.
NearestAnswer run_nearest(QueryTask& task, const SceneAtTime& moment, const NearestRequest& request,
                          const Filter& filter);

// Nearest point of a row's object or triangle or, for a CONSERVATIVE query, of the bounds of the object or triangle.
struct NearestSurface {
  Vec3d offset;  // from request.point to the nearest point; zero if request.point lies inside
  // Unit vector from the nearest point to request.point. If both points are equal, `normal` is the unit normal of the
  // triangle's front; it is zero for an object and for a triangle without area. `normal` is zero for a CONSERVATIVE
  // query.
  Vec3d normal;
  float u = 0, v = 0;  // weights of the triangle's second and third vertex; 0 for an object and if CONSERVATIVE
};
// Returns the nearest point, computed again from the stored object or triangle, since a Hit does not store this
// point. `winding` is the winding of the scene, which determines the front of each triangle.
NearestSurface nearest_surface(const NearestRequest& request, const Hit& row, Winding winding);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_NEAREST_QUERY_H_
