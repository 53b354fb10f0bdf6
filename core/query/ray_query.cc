#include "core/query/ray_query.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/query/placed_triangle.h"

namespace locus {
namespace {

// The best hits so far, and how near the next one must be.
class HitCollector {
 public:
  explicit HitCollector(const RayRequest& request)
      : mode_(request.mode),
        // One more than wanted tells, whatever the order of visiting, whether there were more.
        capacity_(request.mode == RayMode::kAll ? size_t{request.max_results} + 1 : 1),
        limit_(request.t_max) {}

  // Nothing beyond it is wanted; a hit exactly there may be, if its id is lower.
  float limit() const { return limit_; }

  // False when no further hit matters.
  bool offer(const Hit& hit) {
    if (!(hit.t <= limit_)) return true;
    if (answer_.hits.size() == capacity_) {
      if (!nearer(hit, answer_.hits.front())) return true;
      std::pop_heap(answer_.hits.begin(), answer_.hits.end(), nearer);
      answer_.hits.pop_back();
    }
    answer_.hits.push_back(hit);
    std::push_heap(answer_.hits.begin(), answer_.hits.end(), nearer);  // farthest first
    if (answer_.hits.size() == capacity_) limit_ = answer_.hits.front().t;
    return mode_ != RayMode::kAny;
  }

  bool done() const { return mode_ == RayMode::kAny && !answer_.hits.empty(); }

  RayAnswer finish() {
    std::sort_heap(answer_.hits.begin(), answer_.hits.end(), nearer);
    answer_.truncated = mode_ == RayMode::kAll && answer_.hits.size() == capacity_;
    if (answer_.truncated) answer_.hits.pop_back();
    return std::move(answer_);
  }

 private:
  const RayMode mode_;
  const size_t capacity_;
  float limit_;
  RayAnswer answer_;
};

// Distances of the double slab test that would round down to `limit` as a float are not beyond it.
double raised(float limit) {
  return static_cast<double>(std::nextafter(limit, std::numeric_limits<float>::infinity()));
}

// As a finite float, rounded once; the sum turns -0 into 0, so that equal answers have equal bytes.
float distance(double t) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  return static_cast<float>(std::min(t, kLargest)) + 0.0f;
}

// Where a ray enters bounds, 0 from inside. Nothing where it passes them.
std::optional<float> entry(const SlabRay<double>& slabs, const Aabbd& bounds) {
  const Interval<double> interval = slabs.interval(bounds);
  if (!(interval.near <= interval.far) || interval.far < 0) return std::nullopt;
  return distance(std::max(interval.near, 0.0));
}

class ObjectVisitor {
 public:
  ObjectVisitor(QueryTask& task, const RayRequest& request, const Filter& filter, HitCollector& collector)
      : task_(task),
        ray_(Rayd{request.origin, request.direction}, request.inside),
        precision_(request.precision),
        filter_(filter),
        collector_(collector) {}

  const SlabRay<double>& slabs() const { return ray_.slabs(); }
  double limit() const { return raised(collector_.limit()); }
  bool visit(const Object& object) {
    if (!task_.count_test()) return false;
    if (!filter_.accepts(object)) return true;
    const std::optional<float> t = test(object);
    return !t || collector_.offer(hit_on(object, *t));
  }

 private:
  std::optional<float> test(const Object& object) const {
    if (precision_ == Precision::kConservative) return entry(ray_.slabs(), bounds_of(object.shape));
    const std::optional<ShapeHit> hit = ray_hit(ray_, object.shape);
    if (!hit) return std::nullopt;
    return distance(hit->t);
  }

  QueryTask& task_;
  ObjectRay ray_;
  Precision precision_;
  const Filter& filter_;
  HitCollector& collector_;
};

// Triangles of one instance, exactly.
class TriangleVisitor {
 public:
  // `slabs`: of the same ray in world axes. `nearest`: no hit lies before it, where the ray enters the instance's
  // bounds.
  TriangleVisitor(QueryTask& task, const TriangleRay& ray, const SlabRay<double>& slabs, const Instance& instance,
                  float nearest, HitCollector& collector)
      : task_(task), ray_(ray), slabs_(slabs), placed_(instance), nearest_(nearest), collector_(collector) {}

  float limit() const { return ray_.to_scaled(collector_.limit()); }
  bool visit(const Triangle& triangle) {
    if (!task_.count_test()) return false;
    const std::optional<TriangleHit> found = ray_.hit(triangle);
    if (!found) return true;
    const std::optional<float> entered = entry(slabs_, placed_.bounds_of_triangle(triangle));
    if (!entered) return true;
    Hit hit = hit_on(placed_.instance(), std::max(ray_.from_scaled(found->t), std::max(nearest_, *entered)));
    hit.triangle = triangle.number;
    return collector_.offer(hit);
  }

 private:
  QueryTask& task_;
  const TriangleRay& ray_;
  const SlabRay<double>& slabs_;
  PlacedTriangles placed_;
  const float nearest_;
  HitCollector& collector_;
};

// Triangles of one instance by their placed bounds.
class PlacedBoundsVisitor {
 public:
  PlacedBoundsVisitor(QueryTask& task, const SlabRay<double>& slabs, const Instance& instance, float nearest,
                      HitCollector& collector)
      : task_(task), slabs_(slabs), placed_(instance), nearest_(nearest), collector_(collector) {}

  Aabbf bounds() const { return placed_.everything(); }
  bool overlaps(const Aabbf& box) const {
    const std::optional<float> t = entry(slabs_, placed_.bounds_of_box(box));
    return t && *t <= collector_.limit();
  }
  bool visit(const Triangle& triangle) {
    if (!task_.count_test()) return false;
    const std::optional<float> t = entry(slabs_, placed_.bounds_of_triangle(triangle));
    if (!t) return true;
    Hit hit = hit_on(placed_.instance(), std::max(*t, nearest_));
    hit.triangle = triangle.number;
    return collector_.offer(hit);
  }

 private:
  QueryTask& task_;
  const SlabRay<double>& slabs_;
  PlacedTriangles placed_;
  const float nearest_;
  HitCollector& collector_;
};

class InstanceVisitor {
 public:
  InstanceVisitor(QueryTask& task, const RayRequest& request, const Filter& filter, HitCollector& collector)
      : task_(task),
        request_(request),
        slabs_(Rayd{request.origin, request.direction}, kInstancePad),
        filter_(filter),
        collector_(collector) {}

  const SlabRay<double>& slabs() const { return slabs_; }
  double limit() const { return raised(collector_.limit()); }
  bool visit(const Instance& instance) {
    if (!task_.count_test()) return false;
    if (!filter_.accepts(instance)) return true;
    // Part of the verdict, and hits are no nearer: the tree over instances may cull by it.
    const std::optional<float> nearest = entry(slabs_, instance.bounds);
    if (!nearest) return true;
    if (request_.precision == Precision::kConservative)
      visit_bounds(instance, *nearest);
    else
      visit_triangles(instance, *nearest);
    return !task_.ended() && !collector_.done();
  }

 private:
  void visit_triangles(const Instance& instance, float nearest) {
    if (request_.mode != RayMode::kAll && ask_kernel(instance, nearest)) return;
    const TriangleRay ray(instance.transform.point_to_mesh(request_.origin),
                          instance.transform.direction_to_mesh(request_.direction), request_.cull);
    TriangleVisitor visitor(task_, ray, slabs_, instance, nearest, collector_);
    task_.visit_ray(instance.mesh->tree(), ray.slabs(), visitor);
  }
  // False where the triangles have to be asked one by one.
  bool ask_kernel(const Instance& instance, float nearest) {
    const RayKernels* const kernels = task_.ray_kernels();
    const TriangleBvh& tree = instance.mesh->tree();
    const std::optional<KernelRay> ray = kernel_ray(instance);
    if (kernels == nullptr || !ray) return false;
    KernelHit found{};
    (request_.mode == RayMode::kAny ? kernels->any : kernels->first)(tree.tree(), &*ray, &found, 1);
    task_.work().nodes += found.nodes;
    task_.work().tests += found.tests;
    task_.count_tests(found.tests);
    if (found.verdict == KernelVerdict::kMiss) return true;
    if (found.verdict == KernelVerdict::kUndecided || found.t < nearest) return false;
    Hit hit = hit_on(instance, found.t);
    hit.triangle = found.number;
    collector_.offer(hit);
    return true;
  }

  // Nothing where the kernels' bounds do not hold.
  std::optional<KernelRay> kernel_ray(const Instance& instance) const {
    const Vec3d origin = instance.transform.point_to_mesh(request_.origin);
    const Vec3d direction = instance.transform.direction_to_mesh(request_.direction);
    const double longest = max_component(abs(direction));
    const double reach = max_component(abs(origin)) + double{magnitude(instance.mesh->tree().bounds())};
    if (!(longest >= kMinKernelDirection && longest <= kMaxKernelDirection)) return std::nullopt;
    if (!(reach >= kMinKernelReach && reach <= kMaxKernelReach)) return std::nullopt;
    return KernelRay{{origin.x, origin.y, origin.z},
                     {direction.x, direction.y, direction.z},
                     collector_.limit(),
                     request_.cull != Cull::kFront,
                     request_.cull != Cull::kBack};
  }

  void visit_bounds(const Instance& instance, float nearest) {
    PlacedBoundsVisitor visitor(task_, slabs_, instance, nearest, collector_);
    task_.visit_region(instance.mesh->tree(), visitor);
  }

  QueryTask& task_;
  const RayRequest& request_;
  SlabRay<double> slabs_;
  const Filter& filter_;
  HitCollector& collector_;
};

Vec3d point(const float* p) { return {p[0], p[1], p[2]}; }

Cull stored_cull(Cull cull, Winding winding) {
  if (winding == Winding::kCounterClockwise || cull == Cull::kNone) return cull;
  return cull == Cull::kBack ? Cull::kFront : Cull::kBack;
}

}  // namespace

RayRequest ray_request(const QueryBlock& block, const RayColumns& rays, Winding winding, size_t i) {
  RayRequest request;
  request.origin = block.frame + point(ColumnReader<float>(rays.origins, 3).entry(i));
  request.direction = point(ColumnReader<float>(rays.directions, 3).entry(i));
  request.t_max = ColumnReader<float>(rays.t_max, 1).value(i, std::numeric_limits<float>::infinity());
  request.mode = rays.mode;
  request.cull = stored_cull(rays.cull, winding);
  request.inside = rays.inside;
  request.source = block.source;
  request.precision = block.precision;
  request.max_results = block.max_results == 0 ? limits::kDefaultMaxResults : block.max_results;
  return request;
}

RayAnswer run_ray(QueryTask& task, const RayRequest& request, const Filter& filter) {
  HitCollector collector(request);
  if (request.source != Source::kDynamic) {
    InstanceVisitor visitor(task, request, filter, collector);
    task.visit_ray(task.snapshot().statics->tree(), visitor.slabs(), visitor);
  }
  if (request.source != Source::kStatic && !collector.done() && !task.ended()) {
    ObjectVisitor visitor(task, request, filter, collector);
    task.visit_ray(task.snapshot().grid, visitor.slabs(), visitor);
  }
  return collector.finish();
}

Surface surface_at(const RayRequest& request, const Hit& hit, Winding winding) {
  Surface surface;
  if (request.precision == Precision::kConservative) return surface;
  if (hit.object != nullptr) {
    const ObjectRay ray(Rayd{request.origin, request.direction}, request.inside);
    if (const std::optional<ShapeHit> found = ray_hit(ray, hit.object->shape)) surface.normal = found->normal;
    return surface;
  }
  if (hit.instance == nullptr) return surface;
  const Transform& transform = hit.instance->transform;
  const Triangle triangle = hit.instance->mesh->mesh().triangle(hit.triangle);
  const TriangleRay ray(transform.point_to_mesh(request.origin), transform.direction_to_mesh(request.direction));
  if (const std::optional<TriangleHit> found = ray.hit(triangle)) {
    surface.u = found->u;
    surface.v = found->v;
  }
  const Vec3d front = normalized(transform.rotation.to_world(area_normal(triangle)));
  surface.normal = winding == Winding::kClockwise ? -front : front;
  return surface;
}

}  // namespace locus
