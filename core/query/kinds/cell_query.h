// Convex free space around a point: planes that separate the point from the objects and triangles near it, taken from
// near to far. Free functions; any thread may call them with a QueryTask of its own.
#ifndef LOCUS_CORE_QUERY_KINDS_CELL_QUERY_H_
#define LOCUS_CORE_QUERY_KINDS_CELL_QUERY_H_

#include <vector>

#include "core/query/kinds/nearest_query.h"

namespace locus {

struct CellRequest {
  Vec3d point;
  float max_distance;   // > 0
  uint32_t max_planes;  // at least 1
  Source source;
  Precision precision;
};

// Returns the request of query `i` of a block, whose positions count from `origin`.
CellRequest cell_request(const QueryBlock& block, Vec3d origin, const CellColumns& cells, size_t i);

// Plane of a cell: through the nearest point of an object or triangle, square to the way to it.
struct CellPlane {
  Hit row;       // t is the distance from the query's point
  Vec3d offset;  // from the query's point to the nearest point
  Vec3d normal;  // of length 1, outwards
};

// Space around a point: within `radius`, and within all planes.
struct CellAnswer {
  bool is_free = false;    // false: the point lies in or on something, and there is no space
  bool truncated = false;  // more planes were needed
  float radius = 0;
  std::vector<CellPlane> planes;
};

// Answers one query. Objects are searched as of `moment`, which the answer borrows. Cost: that of a nearest query for
// all objects and triangles within the returned radius, and a test of each with each plane.
CellAnswer run_cell(QueryTask& task, const SceneAtTime& moment, const CellRequest& request, const Filter& filter);

// Returns whether the object or triangle of `row`, or with CONSERVATIVE its bounds, lies wholly on or beyond a plane of
// the cell around `point`, up to 2^-40 of the coordinates relative to the point.
bool is_beyond(const CellPlane& plane, Vec3d point, Precision precision, const Hit& row);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_CELL_QUERY_H_
