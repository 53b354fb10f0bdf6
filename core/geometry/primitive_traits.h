// Requirements on the values of a spatial index, as C++20 concepts. A value type needs no base class and no member
// functions: specialise PrimitiveTraits for the type, and Bvh (core/index) and ListIndex (tests/support) can store its
// values. If a member is missing, the compiler prints one error with the line of the concept that requires the member.
// Pure functions; any thread.
//
//   Scalar     float or double: the type of bounds and distances
//   RayQuery   type of a preprocessed ray: slabs() returns its SlabRay for culling; to_scaled(t) converts t from units
//              of the ray's direction to the unit of slabs(), rounded up
//   BallQuery, BoxQuery   types of the query argument of ball() and box()
//   id         unique within one index; among hits at equal distance the lower id wins; remove() of an
//              index finds the value to remove by this id
//   bounds     axis-aligned bounds; every test below also requires that the query overlaps these bounds, so culling by
//              any superset of them loses no result
//   position   reference point, always the same for one value; may lie outside the bounds
//   ray        distance >= 0 of the first hit on the value, even if it exceeds the ray's t_max
//   ball, box  whether the value shares a point with the closed ball or box
//   distance   distance from a point to the value, in double; 0 inside the value; needed for nearest queries only
//   plane      plane in which the value lies, or nullopt if there is none; may be missing; indexes that divide space by
//              planes use it
//
// Source: Hughes et al., Computer Graphics: Principles and Practice, 3rd ed., 2013, ch. 37 (PrimitiveKeyTrait and
// related traits).
#ifndef LOCUS_CORE_GEOMETRY_PRIMITIVE_TRAITS_H_
#define LOCUS_CORE_GEOMETRY_PRIMITIVE_TRAITS_H_

#include <concepts>
#include <cstdint>
#include <optional>

#include "core/geometry/convex_region.h"
#include "core/geometry/ray_triangle.h"
#include "core/geometry/shape.h"
#include "core/geometry/triangle_overlap.h"

namespace locus {

template <class Value>
struct PrimitiveTraits;

template <class Value>
using ScalarOf = typename PrimitiveTraits<Value>::Scalar;

// Values that an index can store and cull. A type may have other traits than PrimitiveTraits: an index takes them as
// its second template argument, so that one type lies at its centroid in one index and at its lowest corner in another.
template <class Value, class Traits = PrimitiveTraits<Value>>
concept Bounded = requires(const Value& value) {
  requires std::floating_point<typename Traits::Scalar>;
  { Traits::id(value) } -> std::same_as<uint64_t>;
  { Traits::bounds(value) } -> std::same_as<Aabb<typename Traits::Scalar>>;
  { Traits::position(value) } -> std::same_as<Vec3<typename Traits::Scalar>>;
};

// Values that an index can test against rays, balls and boxes.
template <class Value, class Traits = PrimitiveTraits<Value>>
concept Primitive = Bounded<Value, Traits> &&
    requires(const Value& value, const typename Traits::RayQuery& ray, const typename Traits::BallQuery& ball,
             const typename Traits::BoxQuery& box, typename Traits::Scalar distance) {
  { ray.slabs() } -> std::same_as<const SlabRay<typename Traits::Scalar>&>;
  { ray.to_scaled(distance) } -> std::same_as<typename Traits::Scalar>;
  { Traits::ray(value, ray) } -> std::same_as<std::optional<typename Traits::Scalar>>;
  { Traits::ball(value, ball) } -> std::same_as<bool>;
  { Traits::box(value, box) } -> std::same_as<bool>;
};

// Values that support nearest queries.
template <class Value, class Traits = PrimitiveTraits<Value>>
concept Measurable = Bounded<Value, Traits> && requires(const Value& value, const Vec3d& point) {
  { Traits::distance(value, point) } -> std::same_as<double>;
};

// Flat values, whose planes can divide space.
template <class Value, class Traits = PrimitiveTraits<Value>>
concept Planar = Bounded<Value, Traits> && requires(const Value& value) {
  { Traits::plane(value) } -> std::same_as<std::optional<Plane>>;
};

template <>
struct PrimitiveTraits<Triangle> {
  using Scalar = float;
  using RayQuery = TriangleRay;
  using BallQuery = Ballf;
  using BoxQuery = Obbf;

  static uint64_t id(const Triangle& triangle) { return triangle.number; }
  static Aabbf bounds(const Triangle& triangle) { return bounds_of(triangle); }
  static Vec3f position(const Triangle& triangle) { return triangle.a; }
  static std::optional<float> ray(const Triangle& triangle, const TriangleRay& ray) {
    const std::optional<TriangleHit> hit = ray.hit(triangle);
    return hit ? std::optional<float>(ray.from_scaled(hit->t)) : std::nullopt;
  }
  static bool ball(const Triangle& triangle, const Ballf& ball) { return ball_overlaps(ball, triangle); }
  static bool box(const Triangle& triangle, const Obbf& box) { return box_overlaps(box, triangle); }
  static double distance(const Triangle& triangle, const Vec3d& point) { return locus::distance(point, triangle); }
  // Returns nullopt for a triangle without area.
  static std::optional<Plane> plane(const Triangle& triangle) {
    const Vec3d normal = area_normal(triangle);
    if (normal == Vec3d{} || !is_finite(normal)) return std::nullopt;
    const Vec3d unit = normalized(normal);
    return Plane{unit, -dot(unit, to_double(triangle.a))};
  }
};

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_PRIMITIVE_TRAITS_H_
