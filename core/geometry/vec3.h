// Vectors of three components: points and directions. Meshes store Vec3f, scenes store Vec3d. Plain values and pure
// functions; any thread. Each sum, difference, product and quotient of components is rounded separately.
#ifndef LOCUS_CORE_GEOMETRY_VEC3_H_
#define LOCUS_CORE_GEOMETRY_VEC3_H_

#include <algorithm>
#include <cmath>

namespace locus {

template <class S>
struct Vec3 {
  S x{}, y{}, z{};

  constexpr S operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
  constexpr S& operator[](int axis) { return axis == 0 ? x : axis == 1 ? y : z; }
  friend constexpr Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend constexpr Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend constexpr Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
  friend constexpr Vec3 operator*(Vec3 a, S s) { return {a.x * s, a.y * s, a.z * s}; }
  friend constexpr bool operator==(const Vec3&, const Vec3&) = default;
};

using Vec3f = Vec3<float>;
using Vec3d = Vec3<double>;

// Returns the vector of the three numbers at `p`.
constexpr Vec3d read_vec3d(const float* p) { return {p[0], p[1], p[2]}; }

template <class S>
constexpr S dot(Vec3<S> a, Vec3<S> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

template <class S>
constexpr Vec3<S> cross(Vec3<S> a, Vec3<S> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

template <class S>
constexpr S squared_length(Vec3<S> a) {
  return dot(a, a);
}

template <class S>
constexpr Vec3<S> min(Vec3<S> a, Vec3<S> b) {
  return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)};
}

template <class S>
constexpr Vec3<S> max(Vec3<S> a, Vec3<S> b) {
  return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}

template <class S>
Vec3<S> abs(Vec3<S> a) {
  return {std::abs(a.x), std::abs(a.y), std::abs(a.z)};
}

template <class S>
constexpr S max_component(Vec3<S> a) {
  return std::max(a.x, std::max(a.y, a.z));
}

template <class S>
bool is_finite(Vec3<S> a) {
  return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}

constexpr Vec3d to_double(Vec3f a) { return {a.x, a.y, a.z}; }
constexpr Vec3d to_double(Vec3d a) { return a; }
constexpr Vec3f to_float(Vec3d a) {
  return {static_cast<float>(a.x), static_cast<float>(a.y), static_cast<float>(a.z)};
}

// Returns the unit vector along `a`, which must not be zero. Scales `a` first, so that its length never over- or
// underflows.
inline Vec3d normalized(Vec3d a) {
  const double scale = max_component(abs(a));
  const Vec3d scaled = {a.x / scale, a.y / scale, a.z / scale};
  const double length = std::sqrt(squared_length(scaled));
  return {scaled.x / length, scaled.y / length, scaled.z / length};
}

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_VEC3_H_
