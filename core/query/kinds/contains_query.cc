#include "core/query/kinds/contains_query.h"

#include "core/geometry/point_in_mesh.h"
#include "core/index/regions.h"
#include "core/query/kinds/winding_search.h"

namespace locus {
namespace {

// Visitor of the triangles of one mesh that a half line may cross. Sums the crossings; stops if the point lies on the
// surface.
class Crossings {
 public:
  // `point` is in mesh axes. `winding` is the winding number around the end of the half line.
  Crossings(QueryTask& task, Vec3d point, HalfLine line, int winding)
      : task_(task), point_(point), line_(line), winding_(winding) {}

  bool visit(const Triangle& triangle) {
    if (!task_.count_test()) return false;
    const Crossing found = crossing(point_, triangle, line_);
    winding_ += found.winding;
    on_surface_ = found.on_surface;
    return !on_surface_;
  }
  bool contained() const { return on_surface_ || winding_ != 0; }

 private:
  QueryTask& task_;
  const Vec3d point_;
  const HalfLine line_;
  int64_t winding_;
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
    // The test against instance.bounds is repeated here because the tree over instances may or may not cull by these
    // bounds, and the result must not depend on culling.
    if (!instance.mesh->is_closed() || !reaches(ball_, instance.bounds)) return true;
    if (options_.precision == Precision::kConservative || winds_around(instance)) rows_.offer(hit_on(instance, 0));
    return !task_.ended();
  }

 private:
  bool winds_around(const Instance& instance) {
    const Vec3d point = without_tiny_coordinates(instance.transform.point_to_mesh(ball_.center));
    const TriangleBvh& tree = instance.mesh->tree();
    // A brute-force search tests all triangles, so it uses a half line without an end.
    const WindingWay way = task_.uses_kernels() ? instance.mesh->winding_cells().way_from(tree, point)
                                                : WindingWay::out(tree.cheapest_half_line(point));
    if (way.is_known) return way.winding != 0;
    if (task_.uses_kernels() && WindingSearch::served(tree)) return search(tree, point, way);
    Crossings crossings(task_, point, way.line, way.winding);
    task_.visit_half_line(tree, HalfLineBoxes(point, way.line, way.end), crossings);
    return !task_.ended() && crossings.contained();
  }

  // Computes winds_around() by the vector kernels, along `way`.
  bool search(const TriangleBvh& tree, Vec3d point, const WindingWay& way) {
    WindingSearch search(tree, point, way);
    while (!search.over()) {
      search.next();
      task_.work().nodes += search.nodes();
      task_.work().tests += search.tests();
      if (!task_.count_tests(search.tests())) return false;
    }
    return search.winds_around();
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
    task.visit_region(moment.statics().tree(), visitor);
  }
  const bool may_find_objects = options.source != Source::kStatic && moment.objects().size() != 0 && !task.ended();
  if (may_find_objects) find_objects_around(task, moment, Balld{point, 0}, options, filter, rows);
  OverlapAnswer answer = rows.finish();
  if (may_find_objects) add_objects(answer, task.found_objects(), moment, options);
  return answer;
}

}  // namespace locus
