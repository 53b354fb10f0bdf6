#include "core/query/kinds/ray_query.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "core/base/check.h"
#include "core/query/kinds/hit_collector.h"
#include "core/query/kinds/instance_rays.h"
#include "core/query/kinds/kernel_rays.h"

namespace locus {
namespace {

// Visitor of the moving objects that one ray may hit.
class ObjectVisitor {
 public:
  ObjectVisitor(QueryTask& task, const SceneAtTime& moment, const RayRequest& request, const Filter& filter,
                HitCollector& collector)
      : task_(task),
        moment_(moment),
        ray_(Rayd{request.origin, request.direction}, request.inside),
        precision_(request.precision),
        filter_(filter),
        collector_(collector) {}

  const SlabRay<double>& slabs() const { return ray_.slabs(); }
  double limit() const { return raised(collector_.limit()); }
  bool visit(const GridRef& object) {
    if (!task_.count_test()) return false;
    if (!filter_.accepts(object.entry())) return true;
    const std::optional<float> t = test(moment_.shape(object));
    return !t || collector_.offer(hit_on(object, *t, moment_));
  }

 private:
  std::optional<float> test(const Shape& shape) const {
    if (precision_ == Precision::kConservative) return entry(ray_.slabs(), bounds_of(shape));
    const std::optional<ShapeHit> hit = ray_hit(ray_, shape);
    if (!hit) return std::nullopt;
    return rounded_distance(hit->t);
  }

  QueryTask& task_;
  const SceneAtTime& moment_;
  ObjectRay ray_;
  Precision precision_;
  const Filter& filter_;
  HitCollector& collector_;
};

// Visitor of instances for rays that the vector kernels do not trace.
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
    // A ray hits an instance only if the ray enters the instance's bounds, and no hit has a lower t than the entry.
    // This test is repeated here because the tree over instances may or may not cull by these bounds, and the result
    // must not depend on culling.
    const std::optional<float> nearest = entry(slabs_, instance.bounds);
    if (!nearest) return true;
    trace_instance(task_, request_, slabs_, instance, *nearest, collector_);
    return !task_.ended() && !collector_.done();
  }

 private:
  QueryTask& task_;
  const RayRequest& request_;
  SlabRay<double> slabs_;
  const Filter& filter_;
  HitCollector& collector_;
};

// Returns whether the vector kernels trace `ray` through the instances. The kernels return the first hits in a mesh, so
// they cannot trace a ray that needs the first hits after a given position.
bool uses_kernels(const QueryTask& task, const RayRequest& ray) {
  return !ray.after.is_given() && ray.precision == Precision::kExact && task.ray_kernels() != nullptr;
}

// Converts `cull` from the scene's `winding` to the counter-clockwise winding in which triangles are stored.
Cull stored_cull(Cull cull, Winding winding) {
  if (winding == Winding::kCounterClockwise || cull == Cull::kNone) return cull;
  return cull == Cull::kBack ? Cull::kFront : Cull::kBack;
}

}  // namespace

RayRequest ray_request(const QueryBlock& block, Vec3d origin, const RayColumns& rays, Winding winding, size_t i) {
  LOCUS_DCHECK_LT(3 * i, rays.origins.size());
  RayRequest request;
  request.origin = origin + read_vec3d(ColumnReader<float>(rays.origins, 3).entry(i));
  request.direction = read_vec3d(ColumnReader<float>(rays.directions, 3).entry(i));
  request.t_max = ColumnReader<float>(rays.t_max, 1).value(i, std::numeric_limits<float>::infinity());
  request.mode = rays.mode;
  request.cull = stored_cull(rays.cull, winding);
  request.inside = rays.inside;
  request.source = block.source;
  request.precision = block.precision;
  request.max_results = block.max_results == 0 ? limits::kDefaultMaxResults : block.max_results;
  request.count_only = block.count_only;
  request.after = RowPosition::of(rays.after, i);
  return request;
}

void find_hits(QueryTask& task, std::vector<PendingRay>& rays,
               absl::FunctionRef<const SceneAtTime&(size_t)> moment_of) {
  if (rays.empty()) return;
  const Source source = rays.front().request.source;
  // Uses the kernels for all rays or for none, because usually either all rays of a block have a position `after`, or
  // none.
  const bool by_kernels =
      std::all_of(rays.begin(), rays.end(), [&](const PendingRay& ray) { return uses_kernels(task, ray.request); });
  if (by_kernels && source != Source::kDynamic) trace_meshes(task, rays);
  for (size_t i = 0; i < rays.size(); ++i) {
    PendingRay& ray = rays[i];
    if (!by_kernels && source != Source::kDynamic && !task.ended()) {
      InstanceVisitor visitor(task, ray.request, ray.filter, ray.collector);
      task.visit_ray(task.snapshot().statics->tree(), visitor.slabs(), visitor);
    }
    if (source != Source::kStatic && !ray.collector.done() && !task.ended()) {
      const SceneAtTime& moment = moment_of(i);
      ObjectVisitor visitor(task, moment, ray.request, ray.filter, ray.collector);
      if (moment.objects().grid().size() != 0) task.visit_objects_on_ray(moment, visitor.slabs(), visitor);
    }
    ray.is_cut = task.ended();
  }
}

RayAnswers run_rays(QueryTask& task, const QueryBlock& block, const RayColumns& columns, const QueryTimes& times,
                    const QueryOrigins& origins, Winding winding, size_t begin, size_t end) {
  LOCUS_DCHECK_LT(begin, end);
  std::vector<PendingRay> rays;
  rays.reserve(end - begin);
  for (size_t i = begin; i < end; ++i) {
    rays.emplace_back(ray_request(block, origins.of(i), columns, winding, i), Filter(block, i));
    if (origins.is_unanchored(i)) rays.back().filter.accept_nothing();
  }
  find_hits(task, rays, [&](size_t i) -> const SceneAtTime& { return times.of(begin + i); });
  RayAnswers answers;
  answers.reserve(rays.size());
  for (PendingRay& ray : rays) {
    answers.push_back(ray.collector.finish());
    answers.back().truncated |= ray.is_cut;
  }
  LOCUS_DCHECK_EQ(answers.size(), end - begin);
  return answers;
}

Surface surface_at(const RayRequest& request, const Hit& hit, Winding winding) {
  Surface surface;
  if (request.precision == Precision::kConservative) return surface;
  if (hit.object) {
    const ObjectRay ray(Rayd{request.origin, request.direction}, request.inside);
    if (const std::optional<ShapeHit> found = ray_hit(ray, hit.object_shape())) surface.normal = found->normal;
    return surface;
  }
  if (hit.instance == nullptr) return surface;
  const Transform& transform = hit.instance->transform;
  const Triangle triangle = hit.instance->mesh->triangle(hit.triangle);
  const TriangleRay ray(transform, request.origin, request.direction);
  if (const std::optional<TriangleHit> found = ray.hit(triangle)) {
    surface.u = found->u;
    surface.v = found->v;
  }
  const Vec3d front = normalized(transform.rotation.to_world(area_normal(triangle)));
  surface.normal = winding == Winding::kClockwise ? -front : front;
  return surface;
}

}  // namespace locus
