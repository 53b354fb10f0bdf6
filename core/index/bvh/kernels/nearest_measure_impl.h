// Distances of candidates in double, four triangles at a time, compiled once for each instruction set by the .cc file
// that includes it. The operations are those of the scalar functions named below, on the same operands, in the same
// order, and without fused multiply-add, so that the results are equal bit for bit. Only the branches of the scalar
// functions are replaced by selections.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_NEAREST_MEASURE_IMPL_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_NEAREST_MEASURE_IMPL_H_

#include "core/base/planted_bug.h"
#include "core/index/bvh/kernels/floats8.h"
#include "core/index/bvh/kernels/nearest_kernels.h"

namespace locus {
namespace {

// One value for each of four triangles. The compiler extends scalars to all lanes.
typedef double Doubles4 __attribute__((vector_size(32)));
typedef long long Mask4 __attribute__((vector_size(32)));

struct Vector4 {
  Doubles4 x, y, z;

  friend inline Vector4 operator-(Vector4 a, Vector4 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend inline Vector4 operator+(Vector4 a, Vector4 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend inline Vector4 operator*(Vector4 a, Doubles4 s) { return {a.x * s, a.y * s, a.z * s}; }
};

static inline Doubles4 dot(Vector4 a, Vector4 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline Doubles4 squared_length(Vector4 a) { return dot(a, a); }
static inline Vector4 cross(Vector4 a, Vector4 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline Doubles4 less_of(Doubles4 a, Doubles4 b) { return b < a ? b : a; }
static inline Doubles4 greater_of(Doubles4 a, Doubles4 b) { return a < b ? b : a; }

// Returns the squared distances that on_edge() in point_triangle.cc computes. `from` and `to` are the vectors from the
// first and the second end of the edge to the point.
__attribute__((always_inline)) inline Doubles4 squared_to_edge(Vector4 edge, Vector4 from, Vector4 to) {
  const Doubles4 along = dot(from, edge), length = squared_length(edge);
  const Doubles4 inside = squared_length(cross(from, edge)) / length;
  const Doubles4 not_before = along >= length ? squared_length(to) : inside;
  return along <= 0 ? squared_length(from) : not_before;
}

// Returns the squared distances that on_face() in point_triangle.cc computes; `farthest` for a triangle for which
// on_face() returns an infinite distance.
__attribute__((always_inline)) inline Doubles4 squared_to_face(Vector4 ab, Vector4 ac, Vector4 bc, Vector4 from_a,
                                                               Vector4 from_b, Doubles4 farthest) {
  const Vector4 normal = cross(ab, ac);
  const Doubles4 nn = squared_length(normal);
  const Doubles4 weight_b = dot(cross(from_a, ac), normal), weight_c = dot(cross(ab, from_a), normal);
  const Doubles4 weight_a = dot(cross(bc, from_b), normal), sum = weight_a + weight_b + weight_c;
  const Mask4 within = (nn != 0) & (weight_a >= 0) & (weight_b >= 0) & (weight_c >= 0) & (sum > 0);
  const Doubles4 height = dot(from_a, normal);
  const Vector4 inward = ab * (weight_b / sum) + ac * (weight_c / sum);
  const double sliver = planted(PlantedBug::kNearestMeasure) ? 0 : 0x1p-40;
  const Mask4 is_sliver = nn < sliver * squared_length(ab) * squared_length(ac);
  const Doubles4 squared = is_sliver ? squared_length(from_a - inward) : height * height / nn;
  return within ? squared : farthest;
}

// Returns one coordinate, in mesh axes, of the same vertex of four triangles; `row` is the row of this coordinate in
// TriangleBlock::vertices.
static inline Doubles4 coordinate(const float* const* lanes, int row) {
  const int at = row * kTreeWidth;
  return Doubles4{lanes[0][at], lanes[1][at], lanes[2][at], lanes[3][at]};
}

// Returns the same vertex of four triangles in world axes, as computed by Transform::point_to_world(). `row` is the
// first of the vertex's rows in TriangleBlock::vertices.
__attribute__((always_inline)) inline Vector4 placed_vertex(const float* const* lanes, int row,
                                                            const NearestPlacement& placement) {
  const Doubles4 x = coordinate(lanes, row), y = coordinate(lanes, row + 1), z = coordinate(lanes, row + 2);
  const double* const r = placement.rotation;
  const double* const t = placement.translation;
  const Vector4 rotated = {r[0] * x + r[1] * y + r[2] * z, r[3] * x + r[4] * y + r[5] * z,
                           r[6] * x + r[7] * y + r[8] * z};
  return {t[0] + rotated.x * placement.scale, t[1] + rotated.y * placement.scale, t[2] + rotated.z * placement.scale};
}

// Returns the distance along one axis from the point to the bounds of the vertices a, b and c, grown by `epsilon`.
static inline Doubles4 gap(Doubles4 a, Doubles4 b, Doubles4 c, double point, double epsilon) {
  const Doubles4 min = less_of(less_of(a, b), c) - epsilon, max = greater_of(greater_of(a, b), c) + epsilon;
  return greater_of(greater_of(min - point, point - max), Doubles4{});
}

// Returns the squared distances of four triangles. lanes[i] points to the first coordinate of triangle i.
__attribute__((always_inline)) inline Doubles4 measured(const float* const* lanes, const NearestPlacement& placement) {
  const Vector4 a = placed_vertex(lanes, 0, placement), b = placed_vertex(lanes, 3, placement),
                c = placed_vertex(lanes, 6, placement);
  const double* const p = placement.point;
  const Vector4 gaps = {gap(a.x, b.x, c.x, p[0], placement.epsilon), gap(a.y, b.y, c.y, p[1], placement.epsilon),
                        gap(a.z, b.z, c.z, p[2], placement.epsilon)};
  const Doubles4 zero = {};
  const Vector4 point = {p[0] - zero, p[1] - zero, p[2] - zero};
  const Vector4 from_a = point - a, from_b = point - b, from_c = point - c;
  const Vector4 ab = b - a, bc = c - b, ca = a - c, ac = c - a;
  Doubles4 squared = squared_to_edge(ab, from_a, from_b);
  squared = less_of(squared, squared_to_edge(bc, from_b, from_c));
  squared = less_of(squared, squared_to_edge(ca, from_c, from_a));
  squared = less_of(squared, squared_to_face(ab, ac, bc, from_a, from_b, squared));
  return greater_of(squared_length(gaps), squared);
}

// Implements NearestKernels::measure.
static void measure_candidates(const TriangleTree& tree, const NearestPlacement& placement,
                               const NearestCandidate* candidates, uint32_t count, double* squared) {
  for (uint32_t first = 0; first < count; first += 4) {
    const float* lanes[4];
    for (uint32_t i = 0; i < 4; ++i) {
      const NearestCandidate& candidate = candidates[first + i < count ? first + i : count - 1];
      lanes[i] = &tree.blocks[candidate.block].vertices[0][candidate.lane];
    }
    const Doubles4 result = measured(lanes, placement);
    for (uint32_t i = 0; i < 4 && first + i < count; ++i) squared[first + i] = result[i];
  }
}

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_NEAREST_MEASURE_IMPL_H_
