#include "client/cli/extras/demo/edge_rays.h"

#include <gtest/gtest.h>

#include "client/cli/extras/demo/brute_force.h"
#include "client/cli/extras/demo/demo_level.h"
#include "client/cli/levels/generate/city.h"

namespace locus::cli {
namespace {

std::vector<Triangle> city() {
  ImportedLevel level;
  level.meshes.push_back(generate_city(240, 5));
  return place_level(level).instances.front().triangles;
}

// Returns the number of rays that hit no triangle between their origin and their target.
size_t count_passed(const EdgeRays& rays, const std::vector<Triangle>& triangles) {
  size_t passed = 0;
  for (size_t i = 0; i < rays.size(); ++i) {
    const auto vec = [i](const std::vector<float>& column) {
      return Vec3d{column[3 * i], column[3 * i + 1], column[3 * i + 2]};
    };
    const TriangleRay ray(vec(rays.origins), vec(rays.directions));
    bool hit = false;
    for (const Triangle& triangle : triangles)
      if (const auto found = ray.hit(triangle)) hit = hit || ray.from_scaled(found->t) <= 1 + kEdgeAllowance;
    if (!hit) ++passed;
  }
  return passed;
}

TEST(EdgeRaysTest, GivesTheRequestedNumberOfRays) { EXPECT_EQ(aim_at_edges(city(), 1000, 1).size(), 1000u); }

TEST(EdgeRaysTest, NoRayMissesAnIntactMesh) {
  const std::vector<Triangle> triangles = city();
  EXPECT_EQ(count_passed(aim_at_edges(triangles, 2000, 1), triangles), 0u);
}

// About half of the rays aimed at an edge hit one triangle at the edge, and half hit the other triangle. So if every
// second triangle is removed from the mesh, some rays must pass through.
TEST(EdgeRaysTest, RaysPassWhereTrianglesAreMissing) {
  const std::vector<Triangle> triangles = city();
  std::vector<Triangle> holed;
  for (const Triangle& triangle : triangles)
    if (triangle.number % 2 == 0) holed.push_back(triangle);
  EXPECT_GT(count_passed(aim_at_edges(triangles, 2000, 1), holed), 100u);
}

TEST(EdgeRaysTest, AMeshWithoutSharedEdgesGivesNone) {
  EXPECT_EQ(aim_at_edges({Triangle{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0}}, 10, 1).size(), 0u);
}

}  // namespace
}  // namespace locus::cli
