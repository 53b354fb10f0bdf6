#include "core/mesh/open_edges.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include "tests/support/random.h"
#include "tests/support/test_scale.h"

namespace locus {
namespace {

struct Columns {
  std::vector<float> vertices;
  std::vector<uint32_t> indices;
};

Columns tetrahedron() { return {{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3}}; }

// Returns the same triangles, each with three vertices of its own.
Columns unshared(const Columns& mesh) {
  Columns result;
  for (const uint32_t index : mesh.indices) {
    result.indices.push_back(static_cast<uint32_t>(result.indices.size()));
    for (size_t axis = 0; axis < 3; ++axis) result.vertices.push_back(mesh.vertices[3 * index + axis]);
  }
  return result;
}

uint64_t count(const Columns& mesh) { return count_open_edges(mesh.vertices, mesh.indices); }

// Returns the number of open edges. Reference for count_open_edges(): a map contains, for each edge, the number of uses
// in one direction minus the number of uses in the opposite direction. Edges are equal if their ends have equal
// coordinates.
uint64_t count_slowly(const Columns& mesh) {
  using Corner = std::tuple<float, float, float>;
  std::map<std::pair<Corner, Corner>, int64_t> uses;
  const auto corner = [&](size_t i) {
    const float* at = &mesh.vertices[3 * mesh.indices[i]];
    return Corner{at[0], at[1], at[2]};
  };
  for (size_t i = 0; i < mesh.indices.size(); ++i) {
    const Corner from = corner(i), to = corner(i % 3 == 2 ? i - 2 : i + 1);
    if (from < to) ++uses[{from, to}];
    if (to < from) --uses[{to, from}];
  }
  uint64_t open = 0;
  for (const auto& [edge, excess] : uses) open += static_cast<uint64_t>(std::abs(excess));
  return open;
}

TEST(OpenEdgesTest, AClosedMeshHasNone) {
  EXPECT_EQ(count(tetrahedron()), 0u);
  EXPECT_EQ(count(unshared(tetrahedron())), 0u);
}

TEST(OpenEdgesTest, AMissingTriangleLeavesThreeOpenEdges) {
  Columns mesh = tetrahedron();
  mesh.indices.resize(9);
  EXPECT_EQ(count(mesh), 3u);
  EXPECT_EQ(count(unshared(mesh)), 3u);
}

TEST(OpenEdgesTest, ATriangleTurnedOverIsUsedTwiceInTheWrongDirection) {
  Columns mesh = tetrahedron();
  std::swap(mesh.indices[0], mesh.indices[1]);
  EXPECT_EQ(count(mesh), 6u);
}

TEST(OpenEdgesTest, MinusZeroIsZero) {
  Columns mesh = unshared(tetrahedron());
  mesh.vertices[0] = -0.0f;
  EXPECT_EQ(count(mesh), 0u);
}

TEST(OpenEdgesTest, TrianglesWithoutAreaCountTheirEdges) {
  const Columns point{{1, 1, 1}, {0, 0, 0}}, there_and_back{{0, 0, 0, 1, 0, 0}, {0, 1, 0}};
  EXPECT_EQ(count(point), 0u);
  EXPECT_EQ(count(there_and_back), 0u);
  const Columns line{{0, 0, 0, 1, 0, 0, 2, 0, 0}, {0, 1, 2}};
  EXPECT_EQ(count(line), 3u);
}

TEST(OpenEdgesTest, RandomMeshesEqualACountByCoordinates) {
  for (uint64_t seed = 0; seed < test::scaled_count(500); ++seed) {
    test::Random random(seed);
    Columns mesh;
    for (uint64_t v = 2 + random.below(8); v > 0; --v)
      for (int axis = 0; axis < 3; ++axis) mesh.vertices.push_back(static_cast<float>(random.whole(0, 1)));
    for (uint64_t t = 1 + random.below(20); t > 0; --t)
      for (int corner = 0; corner < 3; ++corner)
        mesh.indices.push_back(static_cast<uint32_t>(random.below(mesh.vertices.size() / 3)));
    ASSERT_EQ(count(mesh), count_slowly(mesh)) << "seed " << seed;
  }
}

}  // namespace
}  // namespace locus
