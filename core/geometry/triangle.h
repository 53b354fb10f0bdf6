// Mesh triangle: three float vertices in mesh axes, and the triangle's number, which is its position in the uploaded
// index list. A triangle is stored as three vertices, never as a vertex and two edges: neighbours must have bitwise
// equal vertices, or rays leak between them. Plain data; any thread.
#ifndef LOCUS_CORE_GEOMETRY_TRIANGLE_H_
#define LOCUS_CORE_GEOMETRY_TRIANGLE_H_

#include <array>
#include <cstdint>

#include "core/geometry/aabb.h"

namespace locus {

struct Triangle {
  Vec3f a, b, c;
  uint32_t number = 0;

  friend constexpr bool operator==(const Triangle&, const Triangle&) = default;
};

// Corners of a triangle in double, in any axes.
using Corners = std::array<Vec3d, 3>;

constexpr Corners corners_of(const Triangle& t) { return {to_double(t.a), to_double(t.b), to_double(t.c)}; }

constexpr Aabbf bounds_of(const Triangle& t) { return {min(min(t.a, t.b), t.c), max(max(t.a, t.b), t.c)}; }

// Returns the normal on the side from which the vertices appear counter-clockwise, not normalised, computed in double;
// zero for a triangle without area.
constexpr Vec3d area_normal(const Triangle& t) {
  return cross(to_double(t.b) - to_double(t.a), to_double(t.c) - to_double(t.a));
}

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_TRIANGLE_H_
