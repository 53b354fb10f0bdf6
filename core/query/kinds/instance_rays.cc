#include "core/query/kinds/instance_rays.h"

#include <algorithm>
#include <optional>

#include "core/query/kinds/placed_triangle.h"

namespace locus {
namespace {

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

}  // namespace

void ask_instance(QueryTask& task, const RayRequest& request, const SlabRay<double>& slabs, const Instance& instance,
                  float nearest, HitCollector& collector) {
  if (request.precision == Precision::kConservative) {
    PlacedBoundsVisitor visitor(task, slabs, instance, nearest, collector);
    task.visit_region(instance.mesh->tree(), visitor);
    return;
  }
  const TriangleRay ray(instance.transform, request.origin, request.direction, request.cull);
  TriangleVisitor visitor(task, ray, slabs, instance, nearest, collector);
  task.visit_ray(instance.mesh->tree(), ray.slabs(), visitor);
}

}  // namespace locus
