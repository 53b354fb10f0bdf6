#include "core/geometry/point_triangle.h"

#include <array>

#include "gtest/gtest.h"
#include "tests/support/triangle_reference.h"

namespace locus {
namespace {

using test::hairline;
using test::Random;
using test::random_triangle;
using test::Real;
using test::reference_distance;
using test::size_of;
using test::to_real;

TEST(PointTriangleTest, DistanceAgreesWithASearchOverAllWeights) {
  constexpr uint64_t kSeed = 41;
  Random random(kSeed);
  for (int i = 0; i < 10000; ++i) {
    const Triangle t = random_triangle(random);
    const double size = size_of(t) + 1e-6;
    const Vec3d point = to_double(t.a) + random.vector(size * random.magnitude(-8, 3));
    const Real expected = reference_distance(to_real(point), t);
    const Real actual = std::sqrt(Real{squared_distance(point, t)});
    const Real tolerance = 1e-9L * (expected + size);
    ASSERT_NEAR(static_cast<double>(actual), static_cast<double>(expected), static_cast<double>(tolerance))
        << "seed " << kSeed << " case " << i;
  }
}

TEST(PointTriangleTest, DistanceToHairlinesAgreesWithTheSearch) {
  constexpr uint64_t kSeed = 45;
  Random random(kSeed);
  for (int i = 0; i < 5000; ++i) {
    const Triangle t = hairline(random);
    const Vec3d along = to_double(t.b) * random.between(-0.1, 1.1);
    const Vec3d point = along + random.vector(size_of(t) * random.magnitude(-40, 0));
    const Real expected = reference_distance(to_real(point), t);
    const Real actual = std::sqrt(Real{squared_distance(point, t)});
    ASSERT_NEAR(static_cast<double>(actual), static_cast<double>(expected), 1e-9 * size_of(t))
        << "seed " << kSeed << " case " << i;
  }
}

// Point with integer coordinates, so that every squared distance is a fraction of integers.
using Whole = Vec3<int64_t>;

struct Fraction {
  int64_t above, below;
  friend bool operator<(Fraction a, Fraction b) { return a.above * b.below < b.above * a.below; }
};

Fraction to_edge(Whole p, Whole from, Whole to) {
  const Whole edge = to - from, offset = p - from;
  const int64_t along = dot(offset, edge), length = squared_length(edge);
  if (along <= 0) return {squared_length(offset), 1};
  if (along >= length) return {squared_length(p - to), 1};
  return {squared_length(cross(offset, edge)), length};
}

Fraction whole_distance(Whole p, Whole a, Whole b, Whole c) {
  const Fraction edges = std::min(to_edge(p, a, b), std::min(to_edge(p, b, c), to_edge(p, c, a)));
  const Whole n = cross(b - a, c - a);
  if (n == Whole{}) return edges;
  for (const auto& [from, to] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)})
    if (dot(cross(to - from, p - from), n) < 0) return edges;
  const int64_t height = dot(p - a, n);
  return std::min(edges, {height * height, squared_length(n)});
}

Whole lattice_point(int index, int side, int64_t from) {
  return {index % side + from, index / side % side + from, index / side / side + from};
}

Vec3d to_vec(Whole v) { return {double(v.x), double(v.y), double(v.z)}; }
Vec3f to_vec3f(Whole v) { return to_float(to_vec(v)); }

// Tests every triangle with vertices on a lattice of 3x3x3 points, most of them oblique and many without area, with
// every point of a lattice of 5x5x5 around it.
TEST(PointTriangleTest, DistancesOnALatticeAreTheNearestFloats) {
  for (int corners = 0; corners < 27 * 27 * 27; ++corners) {
    const Whole a = lattice_point(corners % 27, 3, 0), b = lattice_point(corners / 27 % 27, 3, 0),
                c = lattice_point(corners / 27 / 27, 3, 0);
    const Triangle triangle{to_vec3f(a), to_vec3f(b), to_vec3f(c), 0};
    for (int index = 0; index < 125; ++index) {
      const Whole p = lattice_point(index, 5, -1);
      const Fraction exact = whole_distance(p, a, b, c);
      const Real expected = std::sqrt(Real(exact.above) / Real(exact.below));
      ASSERT_EQ(static_cast<float>(distance(to_vec(p), triangle)), static_cast<float>(expected))
          << "corners " << corners << " point " << index;
      ASSERT_EQ(exact.above == 0, distance(to_vec(p), triangle) == 0) << "corners " << corners << " point " << index;
    }
  }
}

TEST(PointTriangleTest, TheNearestPointIsOnTheTriangleAtTheDistance) {
  constexpr uint64_t kSeed = 46;
  Random random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    const Triangle t = random.chance(0.2) ? hairline(random) : random_triangle(random);
    const double size = size_of(t) + 1e-6;
    const Vec3d point = to_double(t.a) + random.vector(size * random.magnitude(-8, 3));
    const Vec3d nearest = nearest_on_triangle(point, to_double(t.a), to_double(t.b), to_double(t.c));
    const double gap = std::sqrt(squared_length(point - nearest));
    const double epsilon = 1e-9 * (size + gap);
    ASSERT_NEAR(gap, std::sqrt(squared_distance(point, t)), epsilon) << "seed " << kSeed << " case " << i;
    ASSERT_LE(reference_distance(to_real(nearest), t), epsilon) << "seed " << kSeed << " case " << i;
  }
}

TEST(PointTriangleTest, TheDistanceIsNeverLessThanThatToTheBounds) {
  constexpr uint64_t kSeed = 47;
  Random random(kSeed);
  for (int i = 0; i < 100000; ++i) {
    const Triangle t = random_triangle(random);
    const Vec3d point = to_double(t.a) + random.vector(size_of(t) * random.magnitude(-8, 8));
    ASSERT_GE(distance(point, t), std::sqrt(squared_distance(point, to_double(bounds_of(t)))))
        << "seed " << kSeed << " case " << i;
  }
}

TEST(PointTriangleTest, TheOrderOfCornersChangesTheDistanceOnlyByRounding) {
  const std::array<Vec3d, 3> v = {Vec3d{0, 0, 0}, Vec3d{3, 1, 0}, Vec3d{1, 4, 2}};
  const Vec3d point = {0.3, 0.2, 5};
  const double first = squared_distance(point, v[0], v[1], v[2]);
  for (const auto& [a, b, c] : {std::array{1, 2, 0}, std::array{2, 0, 1}, std::array{2, 1, 0}, std::array{0, 2, 1}})
    EXPECT_DOUBLE_EQ(squared_distance(point, v[size_t(a)], v[size_t(b)], v[size_t(c)]), first);
}

}  // namespace
}  // namespace locus
