// Tests of crossings of triangles by half lines. The references are solid angles in long double, large integers, and
// points on surfaces for which the answer is known by construction.
#include "core/geometry/point_in_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "tests/support/exact_crossing.h"
#include "tests/support/generated_meshes.h"
#include "tests/support/half_lines.h"
#include "tests/support/random.h"
#include "tests/support/real.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

using Mesh = std::vector<Triangle>;

struct Containment {
  int winding = 0;
  bool on_surface = false;
};

Containment inside(Vec3d point, const Mesh& mesh, HalfLine line = {}) {
  Containment result;
  for (const Triangle& triangle : mesh) {
    const Crossing found = crossing(without_tiny_coordinates(point), triangle, line);
    result.winding += found.winding;
    result.on_surface |= found.on_surface;
  }
  return result;
}

// Returns the winding number of a closed mesh around a point, not rounded to an integer: the sum of the solid angles of
// its triangles. Source: Van Oosterom, Strackee, The Solid Angle of a Plane Triangle, 1983.
Real winding_by_angles(Vec3d point, const Mesh& mesh) {
  Real sum = 0;
  for (const Triangle& triangle : mesh) {
    const Vec3r a = to_real(triangle.a) - to_real(point), b = to_real(triangle.b) - to_real(point),
                c = to_real(triangle.c) - to_real(point);
    const Real la = length(a), lb = length(b), lc = length(c);
    sum += 2 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return sum / (4 * std::numbers::pi_v<Real>);
}

// Returns the boundary of the filled cells of a lattice of `side`^3 cells. Each face between a filled cell and an empty
// cell (or the outside) becomes two triangles that face away from the filled cell. All corners have whole coordinates.
Mesh lattice_mesh(int side, const std::vector<bool>& filled) {
  const auto is_filled = [&](int x, int y, int z) {
    const bool within = std::min({x, y, z}) >= 0 && std::max({x, y, z}) < side;
    return within && filled[static_cast<size_t>((x * side + y) * side + z)];
  };
  Mesh mesh;
  for (int x = 0; x < side; ++x)
    for (int y = 0; y < side; ++y)
      for (int z = 0; z < side; ++z)
        for (int axis = 0; axis < 3 && is_filled(x, y, z); ++axis)
          for (const int step : {-1, 1}) {
            int to[3] = {x, y, z};
            to[axis] += step;
            if (is_filled(to[0], to[1], to[2])) continue;
            const auto corner = [&](float u, float v) {
              Vec3f at{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
              at[axis] += step > 0 ? 1.0f : 0.0f;
              at[(axis + 1) % 3] += u;
              at[(axis + 2) % 3] += v;
              return at;
            };
            const float flip = step > 0 ? 1.0f : 0.0f;
            mesh.push_back({corner(0, 0), corner(flip, 1 - flip), corner(1, 1)});
            mesh.push_back({corner(0, 0), corner(1, 1), corner(1 - flip, flip)});
          }
  number_in_order(mesh);
  return mesh;
}

Mesh turned_inside_out(Mesh mesh) {
  for (Triangle& triangle : mesh) std::swap(triangle.b, triangle.c);
  return mesh;
}

TEST(PointInMeshTest, WindingEqualsTheSumOfSolidAngles) {
  for (uint64_t seed = 0; seed < scaled_count(200); ++seed) {
    Random random(seed);
    Mesh mesh = bumpy_sphere(4, 0.3, seed);
    const Mesh inner = turned_inside_out(bumpy_sphere(3, 0.1, seed + 1));
    for (const Triangle& t : inner) mesh.push_back({t.a * 0.3f, t.b * 0.3f, t.c * 0.3f, t.number});
    const bool reversed = random.chance(0.5);
    if (reversed) mesh = turned_inside_out(mesh);
    for (int i = 0; i < 50; ++i) {
      const Vec3d point = random.vector(1.6);
      const Real angle = winding_by_angles(point, mesh);
      for (const HalfLine line : kHalfLines) {
        const Containment found = inside(point, mesh, line);
        ASSERT_FALSE(found.on_surface) << "seed " << seed;
        ASSERT_EQ(found.winding, static_cast<int>(std::lround(angle))) << "seed " << seed << ", angle " << angle;
      }
    }
  }
}

// Rays from lattice points, and from points half-way between them, pass exactly through corners, edges and faces of the
// lattice.
TEST(PointInMeshTest, LatticesAreDecidedWhereRaysMeetEdgesAndCorners) {
  for (uint64_t seed = 0; seed < scaled_count(200); ++seed) {
    Random random(seed);
    constexpr int kSide = 3;
    std::vector<bool> filled;
    for (int i = 0; i < kSide * kSide * kSide; ++i) filled.push_back(random.chance(0.5));
    const Mesh mesh = lattice_mesh(kSide, filled);
    for (int i = 0; i < 100; ++i) {
      Vec3d point;
      for (int axis = 0; axis < 3; ++axis) point[axis] = static_cast<double>(random.whole(-2, 8)) * 0.5;
      // Count the cells whose closure contains the point, and the filled ones among them.
      int cells = 0, full = 0;
      for (int part = 0; part < 8; ++part) {
        int cell[3];
        for (int axis = 0; axis < 3; ++axis)
          cell[axis] = static_cast<int>(std::floor(point[axis] + ((part >> axis & 1) != 0 ? -0.25 : 0.25)));
        const bool within = std::min({cell[0], cell[1], cell[2]}) >= 0 && std::max({cell[0], cell[1], cell[2]}) < kSide;
        ++cells;
        full += within && filled[static_cast<size_t>((cell[0] * kSide + cell[1]) * kSide + cell[2])] ? 1 : 0;
      }
      const int winding = full == 0 ? 0 : 1;
      for (const HalfLine line : kHalfLines) {
        const Containment found = inside(point, mesh, line);
        ASSERT_EQ(found.on_surface, full != 0 && full != cells) << "seed " << seed;
        ASSERT_TRUE(found.on_surface || found.winding == winding) << "seed " << seed;
      }
    }
  }
}

TEST(PointInMeshTest, CornersAndEdgesAndFacesAreOnTheSurface) {
  for (uint64_t seed = 0; seed < scaled_count(100); ++seed) {
    Random random(seed);
    const Mesh mesh = bumpy_sphere(3, 0.3, seed);
    const Triangle& triangle = random.pick(mesh);
    EXPECT_TRUE(inside(to_double(triangle.a), mesh).on_surface) << "seed " << seed;
    const Triangle whole{{0, 0, 0}, {4, 0, 8}, {0, 8, 4}, 0};
    EXPECT_TRUE(crossing({1, 2, 3}, whole).on_surface);
    EXPECT_TRUE(crossing({2, 0, 4}, whole).on_surface);
    EXPECT_FALSE(crossing({3, 7, 11}, whole).on_surface);
  }
}

TEST(PointInMeshTest, TrianglesWithoutAreaAreSegmentsAndPoints) {
  const Triangle segment{{0, 0, 0}, {2, 4, 6}, {1, 2, 3}, 0};
  EXPECT_TRUE(crossing({0.5, 1, 1.5}, segment).on_surface);
  EXPECT_FALSE(crossing({0.5, 1, 1.25}, segment).on_surface);
  const Triangle along_x{{0, 1, 1}, {2, 1, 1}, {1, 1, 1}, 0};
  EXPECT_TRUE(crossing({1.5, 1, 1}, along_x).on_surface);
  EXPECT_FALSE(crossing({-1, 1, 1}, along_x).on_surface);
  EXPECT_EQ(crossing({-1, 1, 1}, along_x).winding, 0);
  const Triangle point{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, 0};
  EXPECT_TRUE(crossing({1, 1, 1}, point).on_surface);
  EXPECT_FALSE(crossing({1, 1, 0.5}, point).on_surface);
}

TEST(PointInMeshTest, CrossingsNearPlanesAndEdgesEqualThoseOfIntegers) {
  int on_surface = 0, crossed = 0;
  for (uint64_t seed = 0; seed < scaled_count(100'000); ++seed) {
    Random random(seed);
    const NearTrial trial = near_trial(random);
    const Crossing found = crossing(trial.point, trial.triangle);
    const Crossing expected = exact_crossing(trial.point, trial.triangle);
    ASSERT_EQ(found.winding, expected.winding) << "seed " << seed;
    ASSERT_EQ(found.on_surface, expected.on_surface) << "seed " << seed;
    on_surface += expected.on_surface ? 1 : 0;
    crossed += expected.winding != 0 ? 1 : 0;
  }
  EXPECT_GT(on_surface, 100);
  EXPECT_GT(crossed, 100);
}

// The points are one step of a double away from a plane through three points with whole coordinates. Arithmetic with
// 106 bits could not resolve their distance from the plane, but the sign of the volume must show on which side they
// are.
TEST(PointInMeshTest, PointsOneStepAwayFromASlopingFaceAreOnTheirSide) {
  const Triangle triangle{{0x1p23f, 0, 0}, {0, 0x1p23f, 0}, {0, 0, 0x1p23f}, 0};
  const double third = 0x1p23 / 4 + 0x1p-30, rest = 0x1p23 - 2 * third;
  EXPECT_TRUE(crossing({third, third, rest}, triangle).on_surface);
  const Crossing below = crossing({std::nextafter(third, 0), third, rest}, triangle),
                 above = crossing({std::nextafter(third, 0x1p24), third, rest}, triangle);
  EXPECT_FALSE(below.on_surface || above.on_surface);
  EXPECT_EQ(std::abs(below.winding), 1);
  EXPECT_EQ(above.winding, 0);
}

TEST(PointInMeshTest, PointsOneStepAwayFromAFaceAreOnTheirSide) {
  const Mesh cube = lattice_mesh(1, {true});
  for (int axis = 0; axis < 3; ++axis) {
    Vec3d point{0.3, 0.7, 0.4};
    point[axis] = std::nextafter(1.0, 0.0);
    EXPECT_EQ(inside(point, cube).winding, 1);
    point[axis] = std::nextafter(1.0, 2.0);
    EXPECT_EQ(inside(point, cube).winding, 0);
    point[axis] = 5e-324;
    EXPECT_TRUE(inside(point, cube).on_surface);
    point[axis] = 0x1p-249;
    EXPECT_EQ(inside(point, cube).winding, 1);
  }
}

}  // namespace
}  // namespace locus::test
