#include "core/query/kinds/contains_query.h"

#include <limits>

#include "core/geometry/point_in_mesh.h"
#include "core/index/regions.h"

namespace locus {
namespace {

// Visitor of the triangles of one mesh that a ray along the x axis may cross. Sums the crossings until the point is
// found to lie on the surface.
class Crossings {
 public:
  // `point` is in mesh axes.
  Crossings(QueryTask& task, Vec3d point) : task_(task), point_(point) {}

  static float limit() { return std::numeric_limits<float>::infinity(); }
  bool visit(const Triangle& triangle) {
    if (!task_.count_test()) return false;
    const Crossing found = crossing(point_, triangle);
    winding_ += found.winding;
    on_surface_ = found.on_surface;
    return !on_surface_;
  }
  bool contained() const { return on_surface_ || winding_ != 0; }

 private:
  QueryTask& task_;
  const Vec3d point_;
  int64_t winding_ = 0;
  bool on_surface_ = false;
};

// Visitor of the instances whose bounds contain the point of one query.
class InstancesAround {
 public:
  InstancesAround(QueryTask& task, Vec3d point, const OverlapOptions& options, const Filter& filter, LowestRows& rows)
      : task_(task), ball_{point, 0}, region_(ball_), options_(options), filter_(filter), rows_(rows) {}

  Aabbd bounds() const { return region_.bounds(); }
  bool overlaps(const Aabbd& box) const { return region_.overlaps(box); }
  bool visit(const Instance& instance) {
    if (!task_.count_test()) return false;
    if (instance.id <= options_.after_id || !filter_.accepts(instance)) return true;
    // The tree over instances may or may not cull by these bounds, and the result must not depend on culling.
    if (!instance.mesh->is_closed() || !reaches(ball_, instance.bounds)) return true;
    if (options_.precision == Precision::kConservative || winds_around(instance)) rows_.offer(hit_on(instance, 0));
    return !task_.ended();
  }

 private:
  bool winds_around(const Instance& instance) {
    const Vec3d point = without_tiny_coordinates(instance.transform.point_to_mesh(ball_.center));
    const PathBoxes ray(point, {1, 0, 0}, {}, magnitude(instance.mesh->bounds()));
    Crossings crossings(task_, point);
    task_.visit_path(instance.mesh->tree(), ray, crossings);
    return !task_.ended() && crossings.contained();
  }

  QueryTask& task_;
  const Balld ball_;
  const BallRegion<double> region_;
  const OverlapOptions& options_;
  const Filter& filter_;
  LowestRows& rows_;
};

}  // namespace

OverlapAnswer run_contains(QueryTask& task, const SceneAtTime& moment, Vec3d point, const OverlapOptions& options,
                           const Filter& filter) {
  LowestRows rows(options.max_results, false, options.count_only);
  if (options.source != Source::kDynamic) {
    InstancesAround visitor(task, point, options, filter, rows);
    task.visit_region(task.snapshot().statics->tree(), visitor);
  }
  OverlapAnswer instances = rows.finish();
  if (options.source == Source::kStatic || task.ended()) return instances;
  OverlapOptions of_objects = options;
  of_objects.source = Source::kDynamic;
  run_ball(task, moment, Balld{point, 0}, of_objects, filter);
  return with_objects(std::move(instances), task.found_objects(), moment, options);
}

}  // namespace locus
