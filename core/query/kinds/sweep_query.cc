#include "core/query/kinds/sweep_query.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/base/check.h"
#include "core/geometry/sweep.h"
#include "core/geometry/swept_bounds.h"
#include "core/query/kinds/hit_collector.h"
#include "core/query/kinds/object_parts.h"
#include "core/query/kinds/placed_triangle.h"

namespace locus {
namespace {

// Returns the limit of a search as a multiple of Mover::way, or 0 for a mover that rests.
double search_limit(const SweptBounds& path, const HitCollector& collector) {
  return path.is_resting() ? 0 : raised(collector.limit());
}

// Returns a limit for first_contact() that includes every contact at t <= 1 whose t, rounded to float, is at most
// `limit`.
double contact_limit(float limit) { return std::min(raised(limit), 1.0); }

// Path of a mover's bounds through the tree of a mesh, in float. Mover::way is scaled by a power of two, so that no
// product over- or underflows. A "scaled" t is a multiple of the scaled vector.
class MeshPath {
 public:
  // `magnitude` is the largest |coordinate| of the mesh.
  MeshPath(const Mover& mover, float magnitude)
      : is_resting_(mover.way == Vec3d{}),
        scale_(is_resting_ ? 1 : scale_of(mover.way)),
        boxes_(mover.start, is_resting_ ? Vec3d{1, 0, 0} : mover.way * (1 / scale_), extent_of(mover), magnitude) {}

  const PathBoxes& boxes() const { return boxes_; }
  // Returns an upper bound, as a scaled t, of the near values of all boxes that may contain a hit at t <= `limit`.
  float to_scaled(float limit) const {
    if (is_resting_) return 0;
    const double scaled = raised(limit) * scale_;
    constexpr float kLargest = std::numeric_limits<float>::max();
    return scaled >= kLargest ? std::numeric_limits<float>::infinity() : next_above(static_cast<float>(scaled));
  }
  // Returns the t, at least 0, at which the path enters `box`, or nullopt.
  std::optional<double> entry(const Aabbf& box) const {
    const std::optional<float> near = boxes_.entry(box);
    if (!near || (is_resting_ && *near > 0)) return std::nullopt;
    return is_resting_ ? 0 : double{std::max(*near, 0.0f)} * (1 / scale_);
  }

 private:
  // Returns the power of two above the largest |component| of `way`. A multiplication by this power or by its
  // reciprocal changes only the exponent, which stays far from the limits of double.
  static double scale_of(Vec3d way) {
    int exponent = 0;
    (void)std::frexp(max_component(abs(way)), &exponent);
    return std::ldexp(1.0, exponent);
  }

  bool is_resting_;
  double scale_;
  PathBoxes boxes_;
};

// Exact test of one sweep against single triangles of one instance.
class ExactSweepTest {
 public:
  // `path` is the sweep in world axes. `nearest` is the t at which the sweep enters the instance's bounds.
  ExactSweepTest(const SweepRequest& request, const SweptBounds& path, const Instance& instance, double nearest)
      : mover_(mover_to_mesh(request.mover, instance.transform)),
        mesh_path_(mover_, instance.mesh->tree().tree().magnitude),
        path_(path),
        at_start_(request.at_start),
        placed_(instance),
        nearest_(nearest) {}

  const MeshPath& mesh_path() const { return mesh_path_; }
  // Returns the t of the first contact, rounded to float; nullopt if there is none up to `limit`. A hit also requires
  // that the mover's bounds overlap the triangle's bounds, in mesh axes and in world axes. The result is at least the t
  // at which these bounds begin to overlap.
  std::optional<float> hit(const Triangle& triangle, float limit) const {
    const std::optional<double> t = first_contact(mover_, corners_of(triangle), at_start_, contact_limit(limit));
    if (!t) return std::nullopt;
    const std::optional<double> near = mesh_path_.entry(bounds_of(triangle));
    if (!near) return std::nullopt;
    const std::optional<double> entered = path_.entry(placed_.bounds_of_triangle(triangle));
    if (!entered) return std::nullopt;
    return rounded_distance(std::max({*t, *near, *entered, nearest_}));
  }

 private:
  const Mover mover_;
  const MeshPath mesh_path_;
  const SweptBounds& path_;
  const AtStart at_start_;
  const LoosePlacedTriangles placed_;
  const double nearest_;
};

bool offer(const Instance& instance, const Triangle& triangle, float t, HitCollector& collector) {
  Hit hit = hit_on(instance, t);
  hit.triangle = triangle.number;
  return collector.offer(hit);
}

// Visitor of the triangles of one instance for EXACT sweeps.
class SweptTriangles {
 public:
  SweptTriangles(QueryTask& task, const ExactSweepTest& exact, const Instance& instance, HitCollector& collector)
      : task_(task), exact_(exact), instance_(instance), collector_(collector) {}

  float limit() const { return exact_.mesh_path().to_scaled(collector_.limit()); }
  bool visit(const Triangle& triangle) {
    if (!task_.count_test()) return false;
    const std::optional<float> t = exact_.hit(triangle, collector_.limit());
    return !t || offer(instance_, triangle, *t, collector_);
  }

 private:
  QueryTask& task_;
  const ExactSweepTest& exact_;
  const Instance& instance_;
  HitCollector& collector_;
};

// Visitor of the triangles of one instance for CONSERVATIVE sweeps: tests the bounds of each triangle in world axes.
// Because of rounding, the exact test may hit a triangle whose bounds the sweep misses or enters later. Such a hit is
// reported at its exact t, so that a CONSERVATIVE sweep finds every exact hit at the same or a lower t.
class SweptPlacedBounds {
 public:
  SweptPlacedBounds(QueryTask& task, const SweepRequest& request, const ExactSweepTest& exact, const Instance& instance,
                    HitCollector& collector)
      : task_(task),
        path_(request.mover, kObjectPad),
        exact_(exact),
        instance_(instance),
        placed_(instance),
        collector_(collector) {}

  Aabbf bounds() const { return instance_.mesh->bounds(); }
  bool overlaps(const Aabbf& box) const {
    const std::optional<double> t = path_.entry(placed_.bounds_of_box(box));
    if (t && *t <= raised(collector_.limit())) return true;
    const std::optional<double> near = exact_.mesh_path().entry(box);
    return near && *near <= raised(collector_.limit());
  }
  bool visit(const Triangle& triangle) {
    if (!task_.count_test()) return false;
    const std::optional<double> entered = path_.entry(placed_.bounds_of_triangle(triangle));
    std::optional<float> t = exact_.hit(triangle, collector_.limit());
    if (entered) t = std::min(t.value_or(rounded_distance(*entered)), rounded_distance(*entered));
    return !t || offer(instance_, triangle, *t, collector_);
  }

 private:
  QueryTask& task_;
  const SweptBounds path_;
  const ExactSweepTest& exact_;
  const Instance& instance_;
  const PlacedTriangles placed_;
  HitCollector& collector_;
};

// Visitor of the instances that one sweep may hit.
class SweptInstances {
 public:
  SweptInstances(QueryTask& task, const SweepRequest& request, const Filter& filter, HitCollector& collector)
      : task_(task),
        request_(request),
        path_(request.mover, kInstancePad),
        slabs_(path_.search_ray(kInstancePad)),
        filter_(filter),
        collector_(collector) {}

  const SlabRay<double>& slabs() const { return slabs_; }
  double limit() const { return search_limit(path_, collector_); }
  bool visit(const Instance& instance) {
    if (!task_.count_test()) return false;
    if (!filter_.accepts(instance)) return true;
    // A sweep hits an instance only if the sweep enters the instance's bounds, and no hit has a lower t than the
    // entry. This test is repeated here because the tree over instances may or may not cull by these bounds, and the
    // result must not depend on culling.
    const std::optional<double> nearest = path_.entry(instance.bounds);
    if (!nearest) return true;
    const ExactSweepTest exact(request_, path_, instance, *nearest);
    if (request_.precision == Precision::kConservative) {
      SweptPlacedBounds visitor(task_, request_, exact, instance, collector_);
      task_.visit_region(instance.mesh->tree(), visitor);
    } else {
      SweptTriangles visitor(task_, exact, instance, collector_);
      task_.visit_path(instance.mesh->tree(), exact.mesh_path().boxes(), visitor);
    }
    return !task_.ended() && !collector_.done();
  }

 private:
  QueryTask& task_;
  const SweepRequest& request_;
  const SweptBounds path_;
  const SlabRay<double> slabs_;
  const Filter& filter_;
  HitCollector& collector_;
};

// Visitor of the moving objects that one sweep may hit.
class SweptObjects {
 public:
  SweptObjects(QueryTask& task, const SceneAtTime& moment, const SweepRequest& request, const Filter& filter,
               HitCollector& collector)
      : task_(task),
        moment_(moment),
        request_(request),
        path_(request.mover, kObjectPad),
        slabs_(path_.search_ray(kObjectPad)),
        filter_(filter),
        collector_(collector) {}

  const SlabRay<double>& slabs() const { return slabs_; }
  double limit() const { return search_limit(path_, collector_); }
  bool visit(const GridRef& object) {
    if (!task_.count_test()) return false;
    if (!filter_.accepts(object.entry())) return true;
    if (has_parts(object)) return visit_parts(object);
    const std::optional<float> t = test(moment_.shape(object));
    return !t || collector_.offer(hit_on(object, *t, moment_));
  }

 private:
  bool visit_parts(const GridRef& object) {
    return for_each_part(moment_, object, filter_.layers(), [&](const PlacedCompound::PlacedPart& part) {
      const std::optional<double> near = path_.entry(part.loose_bounds());
      if (!near || *near > raised(collector_.limit())) return true;
      ++task_.work().tests;
      if (!task_.count_test()) return false;
      const std::optional<float> t = test(part.shape());
      return !t || collector_.offer(hit_on_part(object, part.number(), *t, moment_));
    });
  }
  std::optional<float> test(const Shape& shape) const {
    const std::optional<double> entered = path_.entry(bounds_of(shape));
    if (!entered) return std::nullopt;
    if (request_.precision == Precision::kConservative) return rounded_distance(*entered);
    const std::optional<double> t =
        first_contact(request_.mover, shape, request_.at_start, contact_limit(collector_.limit()));
    if (!t) return std::nullopt;
    return rounded_distance(std::max(*t, *entered));
  }

  QueryTask& task_;
  const SceneAtTime& moment_;
  const SweepRequest& request_;
  const SweptBounds path_;
  const SlabRay<double> slabs_;
  const Filter& filter_;
  HitCollector& collector_;
};

// Returns `first`, the t of the first contact before rounding to float. If `first` is null, because rounding errors hid
// the contact, returns the rounded t, which `hit` stores.
double moment_of(const std::optional<double>& first, const Hit& hit) { return first.value_or(double{hit.t}); }

}  // namespace

SweepRequest sweep_request(const QueryBlock& block, Vec3d origin, const SweepColumns& sweeps, size_t i) {
  LOCUS_DCHECK_LT(3 * i, sweeps.starts.size());
  SweepRequest request;
  Mover& mover = request.mover;
  const Vec3d start = read_vec3d(ColumnReader<float>(sweeps.starts, 3).entry(i));
  mover.start = origin + start;
  mover.way = read_vec3d(ColumnReader<float>(sweeps.ends, 3).entry(i)) - start;
  mover.radius = ColumnReader<float>(sweeps.radii, 1).value(i, 0);
  if (!sweeps.half_axes.empty()) {
    mover.kind = MoverKind::kCapsule;
    mover.half_axis = read_vec3d(ColumnReader<float>(sweeps.half_axes, 3).entry(i));
  }
  if (!sweeps.half_extents.empty()) {
    mover.kind = MoverKind::kBox;
    mover.half = read_vec3d(ColumnReader<float>(sweeps.half_extents, 3).entry(i));
    mover.rotation = rotation_entry(sweeps.rotations, i);
  }
  request.mode = sweeps.mode;
  request.at_start = sweeps.at_start;
  request.source = block.source;
  request.precision = block.precision;
  request.max_results = block.max_results == 0 ? limits::kDefaultMaxResults : block.max_results;
  request.count_only = block.count_only;
  return request;
}

RayAnswer run_sweep(QueryTask& task, const SceneAtTime& moment, const SweepRequest& request, const Filter& filter) {
  HitCollector collector(request.mode, request.max_results, 1, request.count_only, RowPosition());
  if (request.source != Source::kDynamic) {
    SweptInstances visitor(task, request, filter, collector);
    task.visit_ray(moment.statics().tree(), visitor.slabs(), visitor);
  }
  const bool has_objects = request.source != Source::kStatic && moment.objects().grid().size() != 0;
  if (has_objects && !collector.done() && !task.ended()) {
    SweptObjects visitor(task, moment, request, filter, collector);
    task.visit_objects_on_ray(moment, visitor.slabs(), visitor);
  }
  RayAnswer answer = collector.finish();
  answer.truncated |= task.ended();
  return answer;
}

Contact contact_of(const SweepRequest& request, const Hit& hit) {
  LOCUS_DCHECK_NE(hit.id, kNoId);
  const Mover& mover = request.mover;
  if (request.precision == Precision::kConservative) return {0, mover.way * double{hit.t}, {}};
  if (hit.object) {
    const Shape shape = hit.object_shape();
    return contact_at(mover, shape, moment_of(first_contact(mover, shape, request.at_start), hit));
  }
  const Transform& transform = hit.instance->transform;
  const Mover in_mesh = mover_to_mesh(mover, transform);
  const Corners corners = corners_of(hit.instance->mesh->triangle(hit.triangle));
  Contact contact = contact_at(in_mesh, corners, moment_of(first_contact(in_mesh, corners, request.at_start), hit));
  contact.point = transform.rotation.to_world(contact.point) * double{transform.scale};
  contact.normal = normalized(transform.rotation.to_world(contact.normal));
  contact.distance *= transform.scale;
  return contact;
}

}  // namespace locus
