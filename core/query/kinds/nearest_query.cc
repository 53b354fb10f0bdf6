#include "core/query/kinds/nearest_query.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/base/check.h"
#include "core/geometry/point_triangle.h"
#include "core/query/kinds/hit_collector.h"
#include "core/query/kinds/nearest_triangles.h"
#include "core/query/kinds/object_parts.h"
#include "core/query/kinds/placed_triangle.h"

namespace locus {
namespace {

// Returns a limit for squared distances in double: the square root of any larger value rounds to a float above
// `farthest`.
double squared_limit_of(float farthest) { return squared_limit(raised(farthest)); }

// Collector of the nearest rows. Invariant: rows_ has at most count_ rows, which are sorted if in_order_, and otherwise
// form a heap whose front is the last row in the order of nearer().
class NearestRows {
 public:
  explicit NearestRows(const NearestRequest& request)
      : count_only_(request.count_only),
        after_(request.after),
        count_(request.count),
        in_order_(request.count <= kMaxInOrder),
        farthest_(request.max_distance),
        limit_(squared_limit_of(farthest_)) {
    LOCUS_DCHECK_GE(count_, size_t{1});
    rows_.reserve(std::min<size_t>(count_, kMaxInOrder));
  }

  // Returns the largest distance at which a row may still be retained. Once there are count_ rows, a row at exactly
  // this distance is retained only if it precedes the last row in the order of nearer().
  float farthest() const { return farthest_; }
  // Returns the limit of squared distances in world axes. If the squared distance from the query's point to a box
  // exceeds this limit, no object or triangle inside the box can become a retained row.
  double limit() const { return limit_; }

  void offer(const Hit& row) {
    LOCUS_DCHECK_NE(row.id, kNoId);
    if (!(row.t <= farthest_) || !after_.is_before(row)) return;
    if (count_only_) {
      ++answer_count_;
      return;
    }
    if (rows_.size() == count_) {
      if (!nearer(row, last())) return;
      if (!in_order_) std::pop_heap(rows_.begin(), rows_.end(), nearer);
      rows_.pop_back();
    }
    insert(row);
    if (rows_.size() == count_ && last().t != farthest_) {
      LOCUS_DCHECK_LT(last().t, farthest_);
      farthest_ = last().t;
      limit_ = squared_limit_of(farthest_);
    }
    LOCUS_DCHECK_CALL(check_invariants());
  }

  NearestAnswer finish() {
    if (!in_order_) std::sort_heap(rows_.begin(), rows_.end(), nearer);
    LOCUS_DCHECK(std::is_sorted(rows_.begin(), rows_.end(), nearer));
    return {std::move(rows_), answer_count_};
  }

 private:
  // Maximum count_ for which rows_ is sorted at each insertion, which is cheap since rows are offered nearly in order.
  // A larger count_ uses a heap.
  static constexpr size_t kMaxInOrder = 32;

  void check_invariants() const {
    LOCUS_DCHECK_LE(rows_.size(), count_);
    if (rows_.empty()) return;
    LOCUS_DCHECK_LE(last().t, farthest_);
    LOCUS_DCHECK(!nearer(last(), in_order_ ? rows_.front() : rows_.back()));
  }

  const Hit& last() const { return in_order_ ? rows_.back() : rows_.front(); }
  void insert(const Hit& row) {
    rows_.push_back(row);
    if (!in_order_) return std::push_heap(rows_.begin(), rows_.end(), nearer);
    Hit* at = &rows_.back();
    for (; at != rows_.data() && nearer(row, *(at - 1)); --at) *at = *(at - 1);
    *at = row;
  }

  const bool count_only_;
  const RowPosition after_;
  const size_t count_;
  const bool in_order_;
  float farthest_;
  double limit_;
  uint64_t answer_count_ = 0;
  absl::InlinedVector<Hit, 1> rows_;
};

// Visitor of the moving objects that may be nearest to the point of one query.
class ObjectsNear {
 public:
  ObjectsNear(QueryTask& task, const SceneAtTime& moment, const NearestRequest& request, const Filter& filter,
              NearestRows& rows)
      : task_(task), moment_(moment), request_(request), filter_(filter), rows_(rows) {}

  double limit() const { return rows_.limit(); }
  bool visit(const GridRef& object) {
    if (!task_.count_test()) return false;
    if (!filter_.accepts(object.entry())) return true;
    if (has_parts(object)) return visit_parts(object);
    rows_.offer(hit_on(object, distance_to(moment_.shape(object)), moment_));
    return true;
  }

 private:
  float distance_to(const Shape& shape) const {
    return rounded_distance(request_.precision == Precision::kConservative
                                ? std::sqrt(squared_distance(request_.point, bounds_of(shape)))
                                : distance(request_.point, shape));
  }
  // Offers a row for each part of a compound, or one row for its nearest part.
  bool visit_parts(const GridRef& object) {
    Hit nearest;
    for_each_part(moment_, object, filter_.layers(), [&](const PlacedCompound::PlacedPart& part) {
      if (squared_distance(request_.point, part.loose_bounds()) > rows_.limit()) return true;
      ++task_.work().tests;
      if (!task_.count_test()) return false;
      const Hit row = hit_on_part(object, part.number(), distance_to(part.shape()), moment_);
      if (request_.every_triangle)
        rows_.offer(row);
      else if (nearest.id == kNoId || nearer(row, nearest))
        nearest = row;
      return true;
    });
    if (nearest.id != kNoId) rows_.offer(nearest);
    return !task_.ended();
  }

  QueryTask& task_;
  const SceneAtTime& moment_;
  const NearestRequest& request_;
  const Filter& filter_;
  NearestRows& rows_;
};

// Collector of the rows of one instance: one row for each triangle, or one row for the nearest triangle of the
// instance.
class NearestInstanceRows {
 public:
  NearestInstanceRows(const NearestRequest& request, const Instance& instance, NearestRows& rows)
      : request_(request),
        instance_(instance),
        rows_(rows),
        squared_bounds_distance_(squared_distance(request.point, instance.bounds)),
        farthest_(rows.farthest()),
        limit_(rows.limit()) {}

  // Return limits with the same meaning as NearestRows::farthest() and NearestRows::limit(). Without `every_triangle`,
  // the instance has only one row, and the limits decrease to the distance of the nearest triangle found so far.
  float farthest() const { return farthest_; }
  double limit() const { return limit_; }

  // Offers a triangle at the squared distance `squared`. The reported distance is at least the distance to the
  // instance's bounds, because the tree over instances may cull by the distance to these bounds.
  void offer(uint32_t triangle, double squared) {
    Hit row = hit_on(instance_, rounded_distance(std::sqrt(std::max(squared, squared_bounds_distance_))));
    row.triangle = triangle;
    if (request_.every_triangle) {
      rows_.offer(row);
      shrink(rows_.farthest());
    } else if (row.t <= farthest_ && nearer(row, nearest_)) {
      nearest_ = row;
      shrink(row.t);
    }
  }

  void finish() {
    if (nearest_.id != kNoId) rows_.offer(nearest_);
  }

 private:
  void shrink(float farthest) {
    if (farthest == farthest_) return;
    farthest_ = farthest;
    limit_ = squared_limit_of(farthest);
  }

  const NearestRequest& request_;
  const Instance& instance_;
  NearestRows& rows_;
  const double squared_bounds_distance_;
  float farthest_;
  double limit_;
  Hit nearest_;
};

// Visitor of the triangles of one instance for EXACT queries: computes the distance to each triangle in world axes.
class TrianglesNear {
 public:
  TrianglesNear(QueryTask& task, const NearestRequest& request, const Instance& instance, NearestInstanceRows& rows)
      : task_(task),
        point_(request.point),
        transform_(instance.transform),
        placed_(instance),
        rows_(rows),
        epsilon_(epsilon(request, instance)) {}

  // Returns the limit of squared distances in mesh axes.
  double limit() const {
    if (rows_.farthest() != farthest_) {
      farthest_ = rows_.farthest();
      limit_ = squared_limit(mesh_limit());
    }
    return limit_;
  }
  bool visit(const Triangle& triangle) {
    if (!task_.count_test()) return false;
    const Corners corners = corners_of(transform_, triangle);
    const double to_bounds = squared_distance(point_, placed_.bounds_of_corners(corners));
    if (to_bounds > rows_.limit()) return true;
    rows_.offer(triangle.number, std::max(to_bounds, squared_distance(point_, corners[0], corners[1], corners[2])));
    return true;
  }

  // Visits the triangles near `point`, the query's point in mesh axes, by the vector kernels, with the same result as
  // QueryTask::visit_nearest(). Precondition: NearestSearch::served(tree, point).
  void search(const TriangleBvh& tree, Vec3d point, NearestSearch::Find find) {
    // The rows of two triangles are equally near if the distances in world axes are equal after rounding to float. In
    // that case, their distances in mesh axes, multiplied by the scale, differ by at most twice epsilon_ plus the error
    // of this rounding.
    const double slack = 2 * (epsilon_ + std::numeric_limits<float>::min()) / transform_.scale;
    NearestSearch search(tree, point, mesh_limit(), find, slack);
    NearestSearch::Squared squared;
    while (!search.over()) {
      search.next();
      task_.work().nodes += search.nodes();
      task_.work().tests += search.tests();
      search.measure(point_, transform_, placed_.epsilon(), squared);
      for (uint32_t i = 0; i < search.found(); ++i) rows_.offer(search.number(i), squared[i]);
      search.lower_limit(mesh_limit());
      if (!task_.count_tests(search.tests())) return;
    }
  }

 private:
  // Returns the limit of distances in mesh axes.
  double mesh_limit() const { return (raised(rows_.farthest()) + epsilon_) / transform_.scale; }
  // Returns an upper bound of the difference between a distance in world axes and the scaled distance in mesh axes. The
  // bound covers the rounding errors of the transformations, which are relative to the magnitudes of their operands. It
  // also covers the rounding error of the distance to a triangle, which is at most 2^-30 of the triangle's size (the
  // worst case is a very thin triangle).
  static double epsilon(const NearestRequest& request, const Instance& instance) {
    const Transform& transform = instance.transform;
    return 0x1p-26 * (max_component(abs(request.point)) + max_component(abs(transform.translation)) +
                      double{transform.scale} * magnitude(instance.mesh->bounds()));
  }

  QueryTask& task_;
  const Vec3d point_;
  const Transform& transform_;
  const PlacedTriangles placed_;
  NearestInstanceRows& rows_;
  const double epsilon_;
  mutable float farthest_ = -1;  // value of rows_.farthest() from which limit_ was computed
  mutable double limit_ = 0;
};

// Visitor of the triangles of one instance for CONSERVATIVE queries: computes the distance to the bounds of each
// triangle in world axes.
class PlacedBoundsNear {
 public:
  PlacedBoundsNear(QueryTask& task, const NearestRequest& request, const Instance& instance, NearestInstanceRows& rows)
      : task_(task), point_(request.point), mesh_(*instance.mesh), placed_(instance), rows_(rows) {}

  Aabbf bounds() const { return mesh_.bounds(); }
  bool overlaps(const Aabbf& box) const {
    return squared_distance(point_, placed_.bounds_of_box(box)) <= rows_.limit();
  }
  bool visit(const Triangle& triangle) {
    if (!task_.count_test()) return false;
    rows_.offer(triangle.number, squared_distance(point_, placed_.bounds_of_triangle(triangle)));
    return true;
  }

 private:
  QueryTask& task_;
  const Vec3d point_;
  const StaticMesh& mesh_;
  const PlacedTriangles placed_;
  NearestInstanceRows& rows_;
};

// Visitor of the instances that may be nearest to the point of one query.
class InstancesNear {
 public:
  InstancesNear(QueryTask& task, const NearestRequest& request, const Filter& filter, NearestRows& rows)
      : task_(task), request_(request), filter_(filter), rows_(rows) {}

  double limit() const { return rows_.limit(); }
  bool visit(const Instance& instance) {
    if (!task_.count_test()) return false;
    if (!filter_.accepts(instance)) return true;
    NearestInstanceRows rows(request_, instance, rows_);
    const TriangleBvh& tree = instance.mesh->tree();
    if (request_.precision == Precision::kConservative) {
      PlacedBoundsNear visitor(task_, request_, instance, rows);
      task_.visit_region(tree, visitor);
    } else {
      TrianglesNear visitor(task_, request_, instance, rows);
      const Vec3d point = instance.transform.point_to_mesh(request_.point);
      if (task_.uses_kernels() && NearestSearch::served(tree, point))
        visitor.search(tree, point,
                       request_.every_triangle ? NearestSearch::Find::kEvery : NearestSearch::Find::kNearest);
      else
        task_.visit_nearest(tree, point, visitor);
    }
    rows.finish();
    return !task_.ended();
  }

 private:
  QueryTask& task_;
  const NearestRequest& request_;
  const Filter& filter_;
  NearestRows& rows_;
};

}  // namespace

NearestRequest nearest_request(const QueryBlock& block, Vec3d origin, const NearestColumns& nearest, size_t i) {
  LOCUS_DCHECK_LT(3 * i, nearest.points.size());
  const float* offset = ColumnReader<float>(nearest.points, 3).entry(i);
  return {origin + Vec3d{offset[0], offset[1], offset[2]},
          ColumnReader<float>(nearest.max_distances, 1).value(i, std::numeric_limits<float>::infinity()),
          std::max(1u, nearest.count),
          nearest.detail != StaticDetail::kInstances,
          block.count_only,
          RowPosition::of(nearest.after, i),
          block.source,
          block.precision};
}

NearestAnswer run_nearest(QueryTask& task, const SceneAtTime& moment, const NearestRequest& request,
                          const Filter& filter) {
  NearestRows rows(request);
  if (request.source != Source::kStatic) {
    ObjectsNear visitor(task, moment, request, filter, rows);
    task.visit_objects_near(moment, request.point, visitor);
  }
  if (request.source != Source::kDynamic && !task.ended()) {
    InstancesNear visitor(task, request, filter, rows);
    task.visit_nearest(moment.statics().tree(), request.point, visitor);
  }
  return rows.finish();
}

NearestSurface nearest_surface(const NearestRequest& request, const Hit& row, Winding winding) {
  const Vec3d point = request.point;
  const bool conservative = request.precision == Precision::kConservative;
  NearestSurface surface;
  if (row.object) {
    Shape shape = row.object_shape();
    if (conservative) return {nearest_in(point, bounds_of(shape)) - point, {}};
    // Compute with coordinates relative to `point`, which avoids cancellation far from the world's origin.
    shape.position = shape.position - point;
    surface.offset = nearest_on_shape({}, shape);
    if (surface.offset != Vec3d{}) surface.normal = normalized(-surface.offset);
    return surface;
  }
  LOCUS_DCHECK(row.instance != nullptr);
  const Corners corners = corners_of(row.instance->transform, row.instance->mesh->triangle(row.triangle));
  if (conservative) return {nearest_in(point, PlacedTriangles(*row.instance).bounds_of_corners(corners)) - point, {}};
  const Vec3d a = corners[0] - point, ab = corners[1] - corners[0], ac = corners[2] - corners[0];
  surface.offset = nearest_on_triangle({}, a, corners[1] - point, corners[2] - point);
  const Vec3d front = cross(ab, ac), along = surface.offset - a;
  const double area = squared_length(front);
  if (area > 0) {
    surface.u = static_cast<float>(std::clamp(dot(cross(along, ac), front) / area, 0.0, 1.0)) + 0.0f;
    surface.v = static_cast<float>(std::clamp(dot(cross(ab, along), front) / area, 0.0, 1.0)) + 0.0f;
  }
  if (surface.offset != Vec3d{})
    surface.normal = normalized(-surface.offset);
  else if (area > 0)
    surface.normal = normalized(winding == Winding::kClockwise ? -front : front);
  return surface;
}

}  // namespace locus
