#include "core/query/kinds/cell_query.h"

#include <algorithm>
#include <cmath>

#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/geometry/shape_distance.h"
#include "core/query/kinds/placed_triangle.h"

namespace locus {
namespace {

// Number of rows that the first nearest query of a cell requests. Few cells need a second nearest query.
constexpr uint32_t kFirstRows = 32;

// Returns an upper bound of the absolute coordinates, relative to the shape's position, of all points of a shape.
double size_of(const Shape& shape) { return max_component(abs(to_double(shape.size))) * 2 + double{shape.radius}; }

}  // namespace

CellRequest cell_request(const QueryBlock& block, Vec3d origin, const CellColumns& cells, size_t i) {
  return {origin + read_vec3d(ColumnReader<float>(cells.points, 3).entry(i)),
          ColumnReader<float>(cells.max_distances, 1).value(i, 0),
          cells.max_planes == 0 ? limits::kDefaultCellPlanes : cells.max_planes, block.source, block.precision};
}

bool is_beyond(const CellPlane& plane, Vec3d point, Precision precision, const Hit& row) {
  constexpr double kEpsilonOfPlane = 0x1p-40;
  const double at = dot(plane.normal, plane.offset);
  double least = 0, size = 0;
  if (row.object) {
    Shape shape = row.object_shape();
    const Aabbd bounds = bounds_of(shape);
    shape.position = shape.position - point;
    size = max_component(abs(shape.position)) + size_of(shape);
    least = precision == Precision::kConservative
                ? least_along(plane.normal, Aabbd{bounds.min - point, bounds.max - point})
                : least_along(plane.normal, shape);
  } else {
    const Corners corners = corners_of(row.instance->transform, row.instance->mesh->triangle(row.triangle));
    Corners local;
    for (size_t i = 0; i < 3; ++i) {
      local[i] = corners[i] - point;
      size = std::max(size, max_component(abs(local[i])));
    }
    if (precision == Precision::kConservative) {
      const Aabbd bounds = PlacedTriangles(*row.instance).bounds_of_corners(corners);
      least = least_along(plane.normal, Aabbd{bounds.min - point, bounds.max - point});
    } else {
      least = least_along(plane.normal, local);
    }
  }
  // The last summand covers the rounding of world coordinates, which matters far from the world's origin.
  const double epsilon = kEpsilonOfPlane * (size + at + max_component(abs(point)) * 0x1p-8);
  return least >= at - epsilon;
}

CellAnswer run_cell(QueryTask& task, const SceneAtTime& moment, const CellRequest& request, const Filter& filter) {
  CellAnswer cell;
  cell.radius = request.max_distance;
  NearestRequest nearest{request.point,  request.max_distance, kFirstRows, true, false, {},
                         request.source, request.precision};
  while (true) {
    const absl::InlinedVector<Hit, 1> rows = run_nearest(task, moment, nearest, filter).rows;
    for (const Hit& row : rows) {
      const Vec3d offset = nearest_surface(nearest, row, task.snapshot().winding).offset;
      if (row.t == 0 || offset == Vec3d{}) return {};
      const auto beyond = [&](const CellPlane& plane) {
        return is_beyond(plane, request.point, request.precision, row);
      };
      if (!planted(PlantedBug::kCellBeyond) && std::any_of(cell.planes.begin(), cell.planes.end(), beyond)) continue;
      if (cell.planes.size() == request.max_planes) {
        cell.radius = row.t;
        cell.truncated = cell.is_free = true;
        return cell;
      }
      cell.planes.push_back({row, offset, normalized(offset)});
    }
    if (task.ended() || rows.size() < nearest.count) break;
    nearest.after = {rows.back().t, rows.back().id, rows.back().triangle};
    nearest.count = std::min(2 * nearest.count, limits::kMaxNearest);
  }
  cell.is_free = true;
  return cell;
}

}  // namespace locus
