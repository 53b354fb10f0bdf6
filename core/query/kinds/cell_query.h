// Convex free space around a point: planes that separate the point from the objects and triangles near it. The objects
// and triangles are processed from near to far. Free functions; any thread may call them with a QueryTask of its own.
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

// Returns the request of query `i` of a block. The positions of the query are relative to `origin`.
CellRequest cell_request(const QueryBlock& block, Vec3d origin, const CellColumns& cells, size_t i);

// Plane of a cell. The plane contains the nearest point of an object or triangle, and is perpendicular to the line from
// the query's point to this nearest point.
struct CellPlane {
  Hit row;       // t is the distance from the query's point
  Vec3d offset;  // from the query's point to the nearest point
  Vec3d normal;  // unit vector, pointing away from the query's point
};

// Convex space around a point p: all points within `radius` of p that lie on the same side of every plane as p.
struct CellAnswer {
  bool is_free = false;    // false: the point lies in or on an object or triangle, so there is no free space
  bool truncated = false;  // max_planes were not enough; `radius` is the distance of the nearest object or
                           // triangle without a plane
  float radius = 0;
  std::vector<CellPlane> planes;
};

// Answers one query. Objects are searched as of `moment`, which the answer borrows. Cost: a nearest query for all
// objects and triangles within the returned radius, and one test of each object and triangle against each plane.
CellAnswer run_cell(QueryTask& task, const SceneAtTime& moment, const CellRequest& request, const Filter& filter);

// Returns whether the object or triangle of `row` lies wholly on or beyond `plane`, which belongs to the cell around
// `point`. With CONSERVATIVE, the bounds of the object or triangle are tested instead. The tolerance is 2^-40 of the
// coordinates relative to `point`, plus 2^-48 of the coordinates of `point`.
bool is_beyond(const CellPlane& plane, Vec3d point, Precision precision, const Hit& row);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_CELL_QUERY_H_
