// Vector of four lanes: the coordinates x, y, z and a spare value. The builder processes all axes of a float box with
// one vector instruction. Lanes are read by subscript or copied out, never by casting pointers: GCC 12 miscompiles such
// casts. Plain data.
#ifndef LOCUS_CORE_INDEX_QUAD_H_
#define LOCUS_CORE_INDEX_QUAD_H_

#include <array>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "core/geometry/aabb.h"

namespace locus {

template <class S>
struct Quad;

template <>
struct Quad<float> {
  using Lanes = float __attribute__((vector_size(16)));
  Lanes lanes;

  float operator[](int lane) const { return lanes[lane]; }
  static Quad of(float x, float y, float z, float spare) { return {Lanes{x, y, z, spare}}; }
  static Quad splat(float value) { return {Lanes{value, value, value, value}}; }

  friend Quad operator+(Quad a, Quad b) { return {a.lanes + b.lanes}; }
  friend Quad operator-(Quad a, Quad b) { return {a.lanes - b.lanes}; }
  friend Quad operator*(Quad a, Quad b) { return {a.lanes * b.lanes}; }
  // Return the minimum or maximum of each lane. If either operand's lane is NaN, the result is the lane of `b`.
  friend Quad minimum(Quad a, Quad b) { return {a.lanes < b.lanes ? a.lanes : b.lanes}; }
  friend Quad maximum(Quad a, Quad b) { return {a.lanes > b.lanes ? a.lanes : b.lanes}; }

  // Returns 1 in each lane where a <= b, else 0.
  friend Quad less_or_equal(Quad a, Quad b) { return {a.lanes <= b.lanes ? splat(1).lanes : splat(0).lanes}; }

  // Converts each lane to an integer by truncation. The lanes must be in the range of int32_t.
  std::array<int32_t, 4> to_int() const {
    using Integers = int32_t __attribute__((vector_size(16)));
    const auto integers = __builtin_convertvector(lanes, Integers);
    std::array<int32_t, 4> result;
    std::memcpy(result.data(), &integers, sizeof integers);
    return result;
  }
};

// Quad of doubles, whose lanes are processed one by one: only trees of instances use it, and instances are few compared
// to the triangles of a mesh.
template <>
struct Quad<double> {
  std::array<double, 4> lanes;

  double operator[](int lane) const { return lanes[static_cast<size_t>(lane)]; }
  static Quad of(double x, double y, double z, double spare) { return {{x, y, z, spare}}; }
  static Quad splat(double value) { return {{value, value, value, value}}; }

  template <class Combine>
  static Quad each(const Quad& a, const Quad& b, Combine combine) {
    return {{combine(a.lanes[0], b.lanes[0]), combine(a.lanes[1], b.lanes[1]), combine(a.lanes[2], b.lanes[2]),
             combine(a.lanes[3], b.lanes[3])}};
  }
  friend Quad operator+(const Quad& a, const Quad& b) {
    return each(a, b, [](double x, double y) { return x + y; });
  }
  friend Quad operator-(const Quad& a, const Quad& b) {
    return each(a, b, [](double x, double y) { return x - y; });
  }
  friend Quad operator*(const Quad& a, const Quad& b) {
    return each(a, b, [](double x, double y) { return x * y; });
  }
  friend Quad minimum(const Quad& a, const Quad& b) {
    return each(a, b, [](double x, double y) { return x < y ? x : y; });
  }
  friend Quad maximum(const Quad& a, const Quad& b) {
    return each(a, b, [](double x, double y) { return x > y ? x : y; });
  }
  friend Quad less_or_equal(const Quad& a, const Quad& b) {
    return each(a, b, [](double x, double y) { return x <= y ? 1.0 : 0.0; });
  }

  std::array<int32_t, 4> to_int() const {
    return {static_cast<int32_t>(lanes[0]), static_cast<int32_t>(lanes[1]), static_cast<int32_t>(lanes[2]),
            static_cast<int32_t>(lanes[3])};
  }
};

// Box whose corners are quads; the spare lanes are ignored. No default member initializers, because the splitter
// declares arrays of boxes and uses only a part of each array.
template <class S>
struct QuadBox {
  Quad<S> min, max;

  static QuadBox empty() { return {Quad<S>::splat(Aabb<S>::kInfinity), Quad<S>::splat(-Aabb<S>::kInfinity)}; }
  static QuadBox of(const Aabb<S>& box) {
    return {Quad<S>::of(box.min.x, box.min.y, box.min.z, 0), Quad<S>::of(box.max.x, box.max.y, box.max.z, 0)};
  }
  void add(const QuadBox& other) {
    min = minimum(other.min, min);
    max = maximum(other.max, max);
  }
  void add(const Quad<S>& point) { add(QuadBox{point, point}); }
  Aabb<S> box() const { return {{min[0], min[1], min[2]}, {max[0], max[1], max[2]}}; }
};

template <class S>
S half_area(const QuadBox<S>& box) {
  const Quad<S> e = box.max - box.min;
  return e[0] * e[1] + e[1] * e[2] + e[2] * e[0];
}

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_QUAD_H_
