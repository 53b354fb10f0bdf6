#include "core/query/kinds/ray_query.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/query/kinds/hit_collector.h"
#include "core/query/kinds/instance_rays.h"
#include "core/query/kinds/kernel_rays.h"
#include "core/query/kinds/object_boxes.h"
#include "core/query/kinds/object_parts.h"

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
    if (has_parts(object)) return visit_parts(object);
    const std::optional<float> t = test(moment_.shape(object));
    return !t || collector_.offer(hit_on(object, *t, moment_));
  }

 private:
  bool visit_parts(const GridRef& object) {
    return for_each_part(moment_, object, filter_.layers(), [&](const PlacedCompound::PlacedPart& part) {
      const Interval<double> near = ray_.slabs().interval(part.loose_bounds());
      if (!(near.near <= near.far) || near.far < 0 || near.near > limit()) return true;
      ++task_.work().tests;
      if (!task_.count_test()) return false;
      const std::optional<float> t = test(part.shape());
      return !t || collector_.offer(hit_on_part(object, part.number(), *t, moment_));
    });
  }
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

// Finds the objects that rays [first, first + RayBeam::kRays) hit. Returns false, and finds nothing, if the rays are no
// beam or the moment of a ray needs a search of the grid.
bool search_beam(QueryTask& task, std::vector<PendingRay>& all_rays, size_t first,
                 absl::FunctionRef<const SceneAtTime&(size_t)> moment_of, std::vector<ObjectBoxes::Found>& found) {
  if (all_rays.size() - first < RayBeam::kRays || task.snapshot().objects.size() == 0) return false;
  const absl::Span<PendingRay> rays = absl::MakeSpan(all_rays).subspan(first, RayBeam::kRays);
  const Vec3d& origin = rays[0].request.origin;
  for (const PendingRay& ray : rays)
    if (ray.request.origin != origin) return false;
  for (size_t i = first; i < first + RayBeam::kRays; ++i)
    if (moment_of(i).between() || &moment_of(i).objects() != &task.snapshot().objects) return false;
  const std::optional<RayBeam> beam = RayBeam::of(origin, [&](size_t i) { return rays[i].request.direction; });
  const ObjectBoxes* const boxes = beam ? task.object_boxes(rays.size()) : nullptr;
  if (boxes == nullptr) return false;
  float max_depth = 0;
  for (const PendingRay& ray : rays)
    max_depth = std::max(max_depth, beam->depth(ray.request.direction, ray.collector.limit()));
  boxes->find(*beam, max_depth, found, task.work());
  if (found.empty()) return true;
  for (PendingRay& ray : rays) {
    if (ray.collector.done() || task.ended()) continue;
    ObjectVisitor visitor(task, moment_of(first), ray.request, ray.filter, ray.collector);
    for (const ObjectBoxes::Found& one : found) {
      if (one.depth > beam->depth(ray.request.direction, ray.collector.limit())) break;
      const Interval<double> part = visitor.slabs().interval(boxes->box(one.index));
      if (!(part.near <= part.far) || part.far < 0 || part.near > visitor.limit()) continue;
      ++task.work().tests;
      if (!visitor.visit(boxes->object(one.index))) break;
    }
  }
  return true;
}

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
    if (!planted(PlantedBug::kFilterRayMeshes) && !filter_.accepts(instance)) return true;
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

// Returns whether the vector kernels trace `rays` through the instances. The kernels trace EXACT rays only. They return
// the first hits in a mesh, so they cannot trace a ray with a position `after`, which needs the first hits after this
// position. If any ray has a position `after`, the kernels trace none of the rays, because usually either all rays of a
// block or none have one.
bool use_kernels(const QueryTask& task, const std::vector<PendingRay>& rays) {
  if (rays.front().request.precision != Precision::kExact || task.ray_kernels() == nullptr) return false;
  return std::none_of(rays.begin(), rays.end(), [](const PendingRay& ray) { return ray.request.after.is_given(); });
}

// Converts `cull` from the scene's `winding` to the counter-clockwise winding in which triangles are stored.
Cull stored_cull(Cull cull, Winding winding) {
  if (winding == Winding::kCounterClockwise || cull == Cull::kNone) return cull;
  return cull == Cull::kBack ? Cull::kFront : Cull::kBack;
}

}  // namespace

RayReader::RayReader(const QueryBlock& block, const RayColumns& rays, const QueryOrigins& origins, Winding winding)
    : origins_(origins),
      starts_(rays.origins, 3),
      directions_(rays.directions, 3),
      limits_(rays.t_max, 1),
      after_(rays.after.ts.empty() ? nullptr : &rays.after),
      is_rotated_(!block.rotation.empty()),
      rotation_(rotation_entry(block.rotation, 0)) {
  common_.mode = rays.mode;
  common_.cull = stored_cull(rays.cull, winding);
  common_.inside = rays.inside;
  common_.source = block.source;
  common_.precision = block.precision;
  common_.max_results = block.max_results == 0 ? limits::kDefaultMaxResults : block.max_results;
  common_.count_only = block.count_only;
}

void find_hits(QueryTask& task, std::vector<PendingRay>& rays,
               absl::FunctionRef<const SceneAtTime&(size_t)> moment_of) {
  if (rays.empty()) return;
  const Source source = rays.front().request.source;
  const bool by_kernels = use_kernels(task, rays);
  if (by_kernels && source != Source::kDynamic) trace_meshes(task, rays, moment_of);
  std::vector<ObjectBoxes::Found> found;
  size_t beam_end = 0;  // index of the ray after the last beam that search_beam() has searched
  for (size_t i = 0; i < rays.size(); ++i) {
    PendingRay& ray = rays[i];
    if (i >= beam_end && by_kernels && source != Source::kStatic && !task.ended() &&
        search_beam(task, rays, i, moment_of, found))
      beam_end = i + RayBeam::kRays;
    if (!by_kernels && source != Source::kDynamic && !task.ended()) {
      InstanceVisitor visitor(task, ray.request, ray.filter, ray.collector);
      task.visit_ray(moment_of(i).statics().tree(), visitor.slabs(), visitor);
    }
    if (i >= beam_end && source != Source::kStatic && !ray.collector.done() && !task.ended()) {
      const SceneAtTime& moment = moment_of(i);
      if (moment.objects().grid().size() != 0) {
        ObjectVisitor visitor(task, moment, ray.request, ray.filter, ray.collector);
        task.visit_objects_on_ray(moment, visitor.slabs(), visitor);
      }
    }
    ray.is_cut = task.ended();
  }
}

RayAnswers run_rays(QueryTask& task, const QueryBlock& block, const RayColumns& columns, const QueryTimes& times,
                    const QueryOrigins& origins, Winding winding, size_t begin, size_t end) {
  LOCUS_DCHECK_LT(begin, end);
  std::vector<PendingRay> rays;
  rays.reserve(end - begin);
  const RayReader reader(block, columns, origins, winding);
  const bool all_anchored = origins.unanchored().empty();
  for (size_t i = begin; i < end; ++i) {
    rays.emplace_back(reader, block, i);
    if (!all_anchored && origins.is_unanchored(i)) rays.back().filter.accept_nothing();
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
