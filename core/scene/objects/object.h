// Moving object of a scene: its id, group, tag, layers and shape. Plain data.
#ifndef LOCUS_CORE_SCENE_OBJECTS_OBJECT_H_
#define LOCUS_CORE_SCENE_OBJECTS_OBJECT_H_

#include "core/base/ids.h"
#include "core/geometry/primitive_traits.h"

namespace locus {

struct Object {
  Id id = kNoId;
  Group group = 0;
  Tag tag = 0;
  Layers layers = kDefaultLayers;
  Shape shape;

  friend constexpr bool operator==(const Object&, const Object&) = default;
};

template <>
struct PrimitiveTraits<Object> {
  using Scalar = double;
  using RayQuery = ObjectRay;
  using BallQuery = Balld;
  using BoxQuery = Obbd;

  static uint64_t id(const Object& object) { return object.id; }
  static Aabbd bounds(const Object& object) { return bounds_of(object.shape); }
  static Vec3d position(const Object& object) { return object.shape.position; }
  static std::optional<double> ray(const Object& object, const ObjectRay& ray) {
    const std::optional<ShapeHit> hit = ray_hit(ray, object.shape);
    return hit ? std::optional<double>(hit->t) : std::nullopt;
  }
  static bool ball(const Object& object, const Balld& ball) { return ball_overlaps(ball, object.shape); }
  static bool box(const Object& object, const Obbd& box) { return box_overlaps(box, object.shape); }
  static double distance(const Object& object, const Vec3d& point) { return locus::distance(point, object.shape); }
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_OBJECTS_OBJECT_H_
