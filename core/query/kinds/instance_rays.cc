#include "core/query/kinds/instance_rays.h"

#include <algorithm>
#include <optional>

#include "core/base/check.h"
#include "core/query/kinds/placed_triangle.h"

namespace locus {
namespace {

// Exact test of one ray against single triangles of one instance.
class ExactRayTest {
 public:
  // `slabs` is the same ray in world axes, prepared for tests against boxes. `nearest` is the t at which the ray enters
  // the instance's bounds; hit() returns no lower t.
  ExactRayTest(const TriangleRay& ray, const SlabRay<double>& slabs, const Instance& instance, float nearest)
      : ray_(ray), slabs_(slabs), placed_(instance), nearest_(nearest) {}

  const TriangleRay& ray() const { return ray_; }
  std::optional<float> hit(const Triangle& triangle) const {
    const std::optional<TriangleHit> found = ray_.hit(triangle);
    if (!found) return std::nullopt;
    const std::optional<float> entered = entry(slabs_, placed_.bounds_of_triangle(triangle));
    if (!entered) return std::nullopt;
    return std::max(ray_.from_scaled(found->t), std::max(nearest_, *entered));
  }

 private:
  const TriangleRay& ray_;
  const SlabRay<double>& slabs_;
  LoosePlacedTriangles placed_;
  const float nearest_;
};

bool offer(const Instance& instance, const Triangle& triangle, float t, HitCollector& collector) {
  Hit hit = hit_on(instance, t);
  hit.triangle = triangle.number;
  return collector.offer(hit);
}

// Visitor of the triangles of one instance for EXACT rays: tests the triangles themselves.
class TriangleVisitor {
 public:
  TriangleVisitor(QueryTask& task, const ExactRayTest& exact, const Instance& instance, HitCollector& collector)
      : task_(task), exact_(exact), instance_(instance), collector_(collector) {}

  float limit() const { return exact_.ray().to_scaled(collector_.limit()); }
  bool visit(const Triangle& triangle) {
    if (!task_.count_test()) return false;
    const std::optional<float> t = exact_.hit(triangle);
    return !t || offer(instance_, triangle, *t, collector_);
  }

 private:
  QueryTask& task_;
  const ExactRayTest& exact_;
  const Instance& instance_;
  HitCollector& collector_;
};

// Visitor of the triangles of one instance for CONSERVATIVE rays: tests the bounds of each triangle in world axes.
// Because of rounding, the exact test may hit a triangle whose bounds the ray misses or enters later. Such a hit is
// reported at its exact t, so that a CONSERVATIVE ray finds every exact hit at the same or a lower t.
class PlacedBoundsVisitor {
 public:
  PlacedBoundsVisitor(QueryTask& task, const RayRequest& request, const ExactRayTest& exact, const Instance& instance,
                      HitCollector& collector)
      : task_(task),
        slabs_(Rayd{request.origin, request.direction}, kObjectPad),
        exact_(exact),
        instance_(instance),
        placed_(instance),
        collector_(collector) {}

  Aabbf bounds() const { return instance_.mesh->bounds(); }
  bool overlaps(const Aabbf& box) const {
    const std::optional<float> t = entry(slabs_, placed_.bounds_of_box(box));
    return (t && *t <= collector_.limit()) || exact_overlaps(box);
  }
  bool visit(const Triangle& triangle) {
    if (!task_.count_test()) return false;
    std::optional<float> t = entry(slabs_, placed_.bounds_of_triangle(triangle));
    const std::optional<float> exact = exact_.hit(triangle);
    if (exact) t = std::min(t.value_or(*exact), *exact);
    return !t || offer(instance_, triangle, *t, collector_);
  }

 private:
  bool exact_overlaps(const Aabbf& box) const {
    const Interval<float> interval = exact_.ray().slabs().interval(box);
    return interval.near <= interval.far && interval.far >= 0 &&
           interval.near <= exact_.ray().to_scaled(collector_.limit());
  }

  QueryTask& task_;
  const SlabRay<double> slabs_;
  const ExactRayTest& exact_;
  const Instance& instance_;
  const PlacedTriangles placed_;
  HitCollector& collector_;
};

}  // namespace

void trace_instance(QueryTask& task, const RayRequest& request, const SlabRay<double>& slabs, const Instance& instance,
                    float nearest, HitCollector& collector) {
  LOCUS_DCHECK_GE(nearest, 0.0f);
  const bool conservative = request.precision == Precision::kConservative;
  const TriangleRay ray(instance.transform, request.origin, request.direction,
                        conservative ? Cull::kNone : request.cull);
  const ExactRayTest exact(ray, slabs, instance, nearest);
  if (conservative) {
    PlacedBoundsVisitor visitor(task, request, exact, instance, collector);
    task.visit_region(instance.mesh->tree(), visitor);
    return;
  }
  TriangleVisitor visitor(task, exact, instance, collector);
  task.visit_ray(instance.mesh->tree(), ray.slabs(), visitor);
}

}  // namespace locus
