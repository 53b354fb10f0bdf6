// Moving object of a scene: its id, group, tag, layers and shape. Plain data. Borrows the compound of an object of the
// kind kCompound from the set, the store or the caller that made the Object.
#ifndef LOCUS_CORE_SCENE_OBJECTS_OBJECT_H_
#define LOCUS_CORE_SCENE_OBJECTS_OBJECT_H_

#include <algorithm>
#include <limits>
#include <optional>

#include "core/base/ids.h"
#include "core/geometry/compound.h"
#include "core/geometry/primitive_traits.h"

namespace locus {

struct Object {
  Id id = kNoId;
  Group group = 0;
  Tag tag = 0;
  Layers layers = kDefaultLayers;
  Shape shape;
  const Compound* compound = nullptr;  // not null if and only if shape.kind is kCompound

  friend bool operator==(const Object& a, const Object& b) {
    const bool same_compound =
        a.compound == b.compound || (a.compound != nullptr && b.compound != nullptr && *a.compound == *b.compound);
    return same_compound && a.id == b.id && a.group == b.group && a.tag == b.tag && a.layers == b.layers &&
           a.shape == b.shape;
  }
};

// Calls fn(shape) with the shape of the object, or of each part of a compound, until fn() returns false. Returns false
// if it did.
template <class Fn>
bool for_each_shape(const Object& object, const Fn& fn) {
  if (object.compound == nullptr) return fn(object.shape);
  const PlacedCompound placed(*object.compound, object.shape.position, object.shape.rotation);
  return placed.for_each(kAllLayers, [&fn](const auto& part) { return fn(part.shape()); });
}

template <>
struct PrimitiveTraits<Object> {
  using Scalar = double;
  using RayQuery = ObjectRay;
  using BallQuery = Balld;
  using BoxQuery = Obbd;

  static uint64_t id(const Object& object) { return object.id; }
  static Aabbd bounds(const Object& object) {
    Aabbd bounds;
    for_each_shape(object, [&bounds](const Shape& shape) {
      bounds = merge(bounds, bounds_of(shape));
      return true;
    });
    return bounds;
  }
  static Vec3d position(const Object& object) { return object.shape.position; }
  static std::optional<double> ray(const Object& object, const ObjectRay& ray) {
    std::optional<double> t;
    for_each_shape(object, [&](const Shape& shape) {
      const std::optional<ShapeHit> hit = ray_hit(ray, shape);
      if (hit && !(t && *t <= hit->t)) t = hit->t;
      return true;
    });
    return t;
  }
  static bool ball(const Object& object, const Balld& ball) {
    return !for_each_shape(object, [&ball](const Shape& shape) { return !ball_overlaps(ball, shape); });
  }
  static bool box(const Object& object, const Obbd& box) {
    return !for_each_shape(object, [&box](const Shape& shape) { return !box_overlaps(box, shape); });
  }
  static double distance(const Object& object, const Vec3d& point) {
    double least = std::numeric_limits<double>::infinity();
    for_each_shape(object, [&](const Shape& shape) {
      least = std::min(least, locus::distance(point, shape));
      return true;
    });
    return least;
  }
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_OBJECTS_OBJECT_H_
