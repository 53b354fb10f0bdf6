#include "client/cli/extras/demo/brute_force.h"

#include <algorithm>
#include <optional>

#include "core/geometry/triangle_overlap.h"

namespace locus::cli {
namespace {

bool before(const FirstHit& a, const FirstHit& b) { return (a <=> b) < 0; }

// Returns the t at which the ray enters the world bounds of the instance, or nullopt if the ray misses these bounds.
// Because of rounding, the computed t of a hit on a triangle can be smaller than this t. Like the server,
// first_on_instance() then uses this t as the t of the hit.
std::optional<float> entry(const Rayd& ray, const CheckedInstance& instance) {
  const Interval<double> interval =
      SlabRay<double>(ray, kInstancePad).interval(bounds_to_world(instance.transform, instance.mesh_bounds));
  if (!(interval.near <= interval.far) || interval.far < 0) return std::nullopt;
  return static_cast<float>(std::max(interval.near, 0.0));
}

FirstHit first_on_instance(const Rayd& ray, const CheckedInstance& instance) {
  FirstHit best;
  const std::optional<float> min_t = entry(ray, instance);
  if (!min_t) return best;
  const TriangleRay mesh_ray(instance.transform, ray.origin, ray.direction);
  for (const Triangle& triangle : instance.triangles) {
    const std::optional<TriangleHit> hit = mesh_ray.hit(triangle);
    if (!hit) continue;
    const FirstHit found{std::max(mesh_ray.from_scaled(hit->t), *min_t), instance.id, triangle.number};
    best = std::min(best, found, before);
  }
  return best;
}

template <class Query, class MeshQuery, class Reaches>
std::vector<OverlapRow> overlaps_of(const Query& query, MeshQuery to_mesh, Reaches reaches_bounds,
                                    bool (*on_object)(const Query&, const Shape&),
                                    const std::vector<CheckedInstance>& instances,
                                    const std::vector<CheckedObject>& objects) {
  std::vector<OverlapRow> rows;
  for (const CheckedInstance& instance : instances) {
    if (!reaches_bounds(bounds_to_world(instance.transform, instance.mesh_bounds))) continue;
    const auto mesh_query = to_mesh(instance.transform);
    for (const Triangle& triangle : instance.triangles)
      if (mesh_query(triangle)) rows.push_back({instance.id, triangle.number});
  }
  for (const CheckedObject& object : objects)
    if (on_object(query, object.shape)) rows.push_back({object.id, FirstHit().triangle});
  std::sort(rows.begin(), rows.end());
  return rows;
}

}  // namespace

FirstHit BruteForce::first(Vec3d origin, Vec3d direction) const {
  const Rayd ray{origin, direction};
  FirstHit best;
  for (const CheckedInstance& instance : instances_) best = std::min(best, first_on_instance(ray, instance), before);
  const ObjectRay object_ray(ray);
  for (const CheckedObject& object : objects_)
    if (const std::optional<ShapeHit> hit = ray_hit(object_ray, object.shape))
      best = std::min(best, FirstHit{static_cast<float>(hit->t) + 0.0f, object.id, FirstHit().triangle}, before);
  return best;
}

std::vector<OverlapRow> BruteForce::ball(const Balld& ball) const {
  const auto to_mesh = [&ball](const Transform& transform) {
    const Ballf mesh_ball{to_float(transform.point_to_mesh(ball.center)),
                          static_cast<float>(ball.radius / transform.scale)};
    return [mesh_ball](const Triangle& triangle) { return ball_overlaps(mesh_ball, triangle); };
  };
  const auto reaches_bounds = [&ball](const Aabbd& bounds) { return reaches(ball, bounds); };
  return overlaps_of<Balld>(ball, to_mesh, reaches_bounds, ball_overlaps, instances_, objects_);
}

std::vector<OverlapRow> BruteForce::box(const Obbd& box) const {
  const auto to_mesh = [&box](const Transform& transform) {
    const Obbf mesh_box{to_float(transform.point_to_mesh(box.center)), to_float(box.half * (1.0 / transform.scale)),
                        compose(inverse(transform.rotation), box.rotation)};
    return [mesh_box](const Triangle& triangle) { return box_overlaps(mesh_box, triangle); };
  };
  const auto reaches_bounds = [&box](const Aabbd& bounds) { return overlaps(bounds_of(box), bounds); };
  return overlaps_of<Obbd>(box, to_mesh, reaches_bounds, box_overlaps, instances_, objects_);
}

}  // namespace locus::cli
