// Random shapes and rays for the tests of object predicates: general shapes, and shapes on a lattice of small whole
// numbers, where touching is frequent and every test must give the exact result.
#ifndef LOCUS_TESTS_SUPPORT_RANDOM_SHAPE_H_
#define LOCUS_TESTS_SUPPORT_RANDOM_SHAPE_H_

#include <array>

#include "core/geometry/shape.h"
#include "tests/support/random.h"

namespace locus::test {

inline constexpr std::array<ShapeKind, 4> kShapeKinds = {ShapeKind::kPoint, ShapeKind::kBall, ShapeKind::kBox,
                                                         ShapeKind::kCapsule};

inline ObjectRay ray_from(Vec3d origin, Vec3d direction, Inside inside = Inside::kSolid) {
  Rayd ray;
  ray.origin = origin;
  ray.direction = direction;
  return ObjectRay(ray, inside);
}

// Generates a shape of any size from a centimetre to ten kilometres, thin and flat ones included.
inline Shape random_shape(Random& random, ShapeKind kind, double position_size) {
  Shape shape;
  shape.kind = kind;
  shape.position = random.vector(position_size);
  if (random.chance(0.7)) shape.rotation = random.rotation();
  const double scale = random.magnitude(-7, 13);
  for (int axis = 0; axis < 3; ++axis) {
    const double thinness = random.chance(0.2) ? random.magnitude(-10, 0) : 1;
    shape.size[axis] = random.chance(0.1) ? 0.0f : random.float_between(0.1 * scale, scale) * float(thinness);
  }
  shape.radius = random.chance(0.1) ? 0.0f : random.float_between(0.1 * scale, scale);
  return shape;
}

// Generates an unrotated shape. Its position is whole and at most `reach` on each axis; its size and radius are small
// whole numbers.
inline Shape lattice_shape(Random& random, ShapeKind kind, int reach) {
  Shape shape;
  shape.kind = kind;
  shape.position = random.whole_vector(reach);
  shape.size = to_float(abs(random.whole_vector(3)));
  shape.radius = static_cast<float>(random.whole(0, 5));
  return shape;
}

// Sets the shape's radius to 5 and generates a tangent to the ball of this radius around the shape's centre. Relative
// to the centre, the tangent touches the ball at the coordinates 3 and 4 or -4 on two axes; its direction has whole
// components.
inline Rayd tangent_ray(Random& random, Shape& shape) {
  shape.radius = 5;
  const int x = random.whole(0, 2), y = (x + random.whole(1, 2)) % 3, z = 3 - x - y;
  const double sign = random.chance(0.5) ? 1 : -1;
  Vec3d surface, direction;
  surface[x] = 3;
  surface[y] = 4 * sign;
  direction[x] = 4 * random.whole(-1, 1);
  direction[y] = -0.75 * direction[x] * sign;
  direction[z] = random.whole(-2, 2);
  if (direction == Vec3d{}) direction[z] = 1;
  return {shape.position + surface - direction * static_cast<double>(random.whole(0, 4)), direction};
}

// Generates a ray aimed at or just beside the shape, from near or far.
inline Rayd random_ray(Random& random, const Shape& shape, double size) {
  const double away = size * random.magnitude(-2, 6);
  const Vec3d origin = shape.position + random.unit_vector() * away;
  const Vec3d target = shape.position + random.vector(1) * (size * random.magnitude(-4, 0.5));
  Vec3d direction = target - origin;
  if (random.chance(0.2)) direction[static_cast<int>(random.below(3))] = 0;
  if (direction == Vec3d{}) direction = {1, 0, 0};
  return {origin, direction * random.magnitude(-30, 30)};
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_RANDOM_SHAPE_H_
