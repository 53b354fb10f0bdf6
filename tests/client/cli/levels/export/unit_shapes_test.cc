#include "client/cli/levels/export/unit_shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/client/cli/levels/generate/mesh_facts.h"

namespace locus::cli {
namespace {

using testing::dot;
using testing::normal;
using testing::vertex;

size_t border_of(const ImportedMesh& mesh) {
  std::unordered_set<uint64_t> edges;
  EXPECT_EQ(testing::repeated_edges(mesh, edges), 0u) << mesh.name;
  return testing::open_edges(edges);
}

TEST(UnitShapesTest, BallBoxAndMarkerAreClosedAndThePartsOfACapsuleFitTogether) {
  EXPECT_EQ(border_of(unit_ball()), 0u);
  EXPECT_EQ(border_of(unit_box()), 0u);
  EXPECT_EQ(border_of(unit_marker()), 0u);
  EXPECT_EQ(border_of(unit_dome()), size_t{kShapeSectors});
  EXPECT_EQ(border_of(unit_tube()), size_t{2 * kShapeSectors});
}

TEST(UnitShapesTest, EveryTriangleFacesOut) {
  for (const ImportedMesh& mesh : {unit_ball(), unit_box(), unit_marker(), unit_dome(), unit_tube()}) {
    for (size_t triangle = 0; triangle < mesh.indices.size() / 3; ++triangle)
      EXPECT_GT(dot(normal(mesh, triangle), vertex(mesh, mesh.indices[3 * triangle])), 0) << mesh.name << triangle;
  }
}

TEST(UnitShapesTest, EachExtendsToOneAlongEveryAxis) {
  for (const ImportedMesh& mesh : {unit_ball(), unit_box(), unit_marker(), unit_tube()}) {
    for (size_t axis = 0; axis < 3; ++axis) {
      float low = 0;
      float high = 0;
      for (size_t i = axis; i < mesh.vertices.size(); i += 3) {
        low = std::min(low, mesh.vertices[i]);
        high = std::max(high, mesh.vertices[i]);
      }
      EXPECT_FLOAT_EQ(low, -1) << mesh.name;
      EXPECT_FLOAT_EQ(high, 1) << mesh.name;
    }
  }
}

TEST(UnitShapesTest, VerticesOfRoundShapesLieOnTheShape) {
  for (const ImportedMesh& mesh : {unit_ball(), unit_dome()}) {
    for (uint32_t i = 0; i < mesh.vertices.size() / 3; ++i)
      EXPECT_NEAR(dot(vertex(mesh, i), vertex(mesh, i)), 1, 1e-6) << mesh.name;
  }
}

}  // namespace
}  // namespace locus::cli
