// Rays from inside a closed mesh always hit the mesh. They are aimed at every edge and most vertices of a dented
// icosphere of 20,480 triangles.
#include <map>
#include <utility>
#include <vector>

#include "core/geometry/ray_triangle.h"
#include "core/geometry/transform.h"
#include "gtest/gtest.h"
#include "tests/support/random.h"

namespace locus {
namespace {

using Edge = std::pair<uint32_t, uint32_t>;

struct Sphere {
  std::vector<Vec3d> vertices;
  std::vector<std::array<uint32_t, 3>> faces;
};

Sphere icosahedron() {
  const double g = (1 + std::sqrt(5.0)) / 2;
  return {{{-1, g, 0},
           {1, g, 0},
           {-1, -g, 0},
           {1, -g, 0},
           {0, -1, g},
           {0, 1, g},
           {0, -1, -g},
           {0, 1, -g},
           {g, 0, -1},
           {g, 0, 1},
           {-g, 0, -1},
           {-g, 0, 1}},
          {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
           {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
           {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}}};
}

Sphere subdivided(const Sphere& coarse) {
  Sphere fine{coarse.vertices, {}};
  std::map<Edge, uint32_t> middles;
  const auto middle = [&](uint32_t a, uint32_t b) {
    const auto [found, added] = middles.try_emplace(std::minmax(a, b), static_cast<uint32_t>(fine.vertices.size()));
    if (added) fine.vertices.push_back((fine.vertices[a] + fine.vertices[b]) * 0.5);
    return found->second;
  };
  for (const auto& [a, b, c] : coarse.faces) {
    const uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    fine.faces.insert(fine.faces.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
  }
  return fine;
}

// Closed mesh with float vertices, and lists of the triangles around each vertex.
class DentedSphere {
 public:
  DentedSphere(double size, Vec3d offset, uint64_t seed) {
    Sphere sphere = icosahedron();
    for (int level = 0; level < 5; ++level) sphere = subdivided(sphere);
    test::Random random(seed);
    for (const Vec3d& v : sphere.vertices)
      vertices_.push_back(to_float(normalized(v) * (size * random.between(0.99, 1.01)) + offset));
    around_.resize(vertices_.size());
    for (const auto& [a, b, c] : sphere.faces) {
      const auto number = static_cast<uint32_t>(triangles_.size());
      triangles_.push_back({vertices_[a], vertices_[b], vertices_[c], number});
      for (const Edge& edge : {Edge(a, b), Edge(b, c), Edge(c, a)}) {
        around_[edge.first].push_back(number);
        if (edge.first < edge.second) edges_.push_back(edge);
      }
    }
  }

  const std::vector<Vec3f>& vertices() const { return vertices_; }
  const std::vector<Edge>& edges() const { return edges_; }

  // Returns whether the ray hits any triangle; tests the triangles around both ends of `edge` first, since the ray is
  // aimed at `edge`.
  bool is_hit(const TriangleRay& ray, const Edge& edge) const {
    for (const uint32_t end : {edge.first, edge.second})
      for (const uint32_t number : around_[end])
        if (ray.hit(triangles_[number])) return true;
    for (const Triangle& triangle : triangles_)
      if (ray.hit(triangle)) return true;
    return false;
  }

 private:
  std::vector<Vec3f> vertices_;
  std::vector<Triangle> triangles_;
  std::vector<std::vector<uint32_t>> around_;
  std::vector<Edge> edges_;
};

// Aims rays at the first vertex, the middle and a random point of each edge. Returns the count of rays that leak.
template <class ToMesh>
int leaks(const DentedSphere& sphere, const ToMesh& ray_in_mesh, uint64_t seed) {
  test::Random random(seed);
  int count = 0;
  for (const Edge& edge : sphere.edges()) {
    const Vec3d a = to_double(sphere.vertices()[edge.first]), b = to_double(sphere.vertices()[edge.second]);
    for (const double weight : {0.0, 0.5, random.unit()})
      count += !sphere.is_hit(ray_in_mesh(random, a + (b - a) * weight), edge);
  }
  return count;
}

TEST(WatertightTest, NoRayFromInsideLeaksAtAnyScaleAndOffset) {
  constexpr uint64_t kSeed = 61;
  for (const double size : {1e-3, 1.0, 1e3}) {
    for (const double offset : {0.0, 1.0, 1e3}) {
      const Vec3d center = Vec3d{0.7, -0.4, 0.2} * (offset * size);
      const DentedSphere sphere(size, center, kSeed);
      const auto ray = [&](test::Random& random, Vec3d target) {
        const Vec3d origin = center + random.vector(0.5) * size;
        return TriangleRay(origin, target - origin);
      };
      EXPECT_EQ(leaks(sphere, ray, kSeed), 0) << "seed " << kSeed << " size " << size << " offset " << offset;
    }
  }
}

TEST(WatertightTest, FloatDirectionsFromTheExactCentreDoNotLeak) {
  constexpr uint64_t kSeed = 62;
  const DentedSphere sphere(1, {0, 0, 0}, kSeed);
  const auto ray = [](test::Random&, Vec3d target) { return TriangleRay({0, 0, 0}, to_double(to_float(target))); };
  EXPECT_EQ(leaks(sphere, ray, kSeed), 0);
}

TEST(WatertightTest, InstancesFarFromTheOriginDoNotLeak) {
  constexpr uint64_t kSeed = 63;
  const DentedSphere sphere(1, {0, 0, 0}, kSeed);
  test::Random placing(kSeed);
  for (const float scale : {1e-3f, 1.0f, 1e3f}) {
    const Transform placed = make_transform({1e6, -2e6, 5e5}, placing.rotation(), scale);
    const auto ray = [&](test::Random& random, Vec3d target) {
      const Vec3d origin = placed.point_to_world(random.vector(0.5));
      const Vec3d direction = placed.point_to_world(target) - origin;
      return TriangleRay(placed.point_to_mesh(origin), placed.direction_to_mesh(direction));
    };
    EXPECT_EQ(leaks(sphere, ray, kSeed), 0) << "seed " << kSeed << " scale " << scale;
  }
}

// The sphere is so far from the origin that vertices are rounded to coarsely spaced floats, some of them to the same
// point; the mesh stays closed.
TEST(WatertightTest, MeshesDegradedByFloatSpacingDoNotLeak) {
  constexpr uint64_t kSeed = 64;
  const Vec3d center = {1e6, 1e6, -1e6};
  const DentedSphere sphere(1, center, kSeed);
  const auto ray = [&](test::Random& random, Vec3d target) {
    const Vec3d origin = center + random.vector(0.3);
    return TriangleRay(origin, target - origin);
  };
  EXPECT_EQ(leaks(sphere, ray, kSeed), 0);
}

}  // namespace
}  // namespace locus
