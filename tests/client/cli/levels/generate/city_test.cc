#include "client/cli/levels/generate/city.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

namespace locus::cli {
namespace {

constexpr size_t kBoxIndices = 36;

struct Bounds {
  std::array<float, 3> min, max;
};

Bounds box_bounds(const ImportedMesh& mesh, size_t box) {
  const float* first = &mesh.vertices[box * 24];
  Bounds bounds{{first[0], first[1], first[2]}, {first[0], first[1], first[2]}};
  for (size_t vertex = 1; vertex < 8; ++vertex) {
    for (size_t axis = 0; axis < 3; ++axis) {
      bounds.min[axis] = std::min(bounds.min[axis], first[3 * vertex + axis]);
      bounds.max[axis] = std::max(bounds.max[axis], first[3 * vertex + axis]);
    }
  }
  return bounds;
}

// Returns six times the volume enclosed by the triangles of the box: positive if they face outward.
double six_volumes(const ImportedMesh& mesh, size_t box) {
  double sum = 0;
  for (size_t i = box * kBoxIndices; i < (box + 1) * kBoxIndices; i += 3) {
    const float* a = &mesh.vertices[3 * mesh.indices[i]];
    const float* b = &mesh.vertices[3 * mesh.indices[i + 1]];
    const float* c = &mesh.vertices[3 * mesh.indices[i + 2]];
    sum += double{a[0]} * (double{b[1]} * c[2] - double{b[2]} * c[1]) -
           double{a[1]} * (double{b[0]} * c[2] - double{b[2]} * c[0]) +
           double{a[2]} * (double{b[0]} * c[1] - double{b[1]} * c[0]);
  }
  return sum;
}

TEST(CityTest, TheCountIsAtMostTheRequestedAndLessThanOneBoxBelow) {
  for (uint64_t asked : {12, 13, 23, 24, 25, 100, 999, 12'000, 100'003}) {
    const size_t count = generate_city(asked, 5).indices.size() / 3;
    EXPECT_LE(count, asked);
    EXPECT_GT(count + 12, asked);
  }
  for (uint64_t asked : {0, 1, 11}) EXPECT_EQ(generate_city(asked, 5).indices.size() / 3, 12u) << asked;
}

TEST(CityTest, EqualSeedsGiveEqualBytesAndOthersDiffer) {
  const ImportedMesh one = generate_city(5000, 1);
  const ImportedMesh same = generate_city(5000, 1);
  const ImportedMesh other = generate_city(5000, 2);
  EXPECT_EQ(one.vertices, same.vertices);
  EXPECT_EQ(one.indices, same.indices);
  EXPECT_NE(one.vertices, other.vertices);
}

TEST(CityTest, EveryEdgeIsSharedByTwoTrianglesInOppositeDirections) {
  const ImportedMesh mesh = generate_city(6000, 3);
  std::map<std::pair<uint32_t, uint32_t>, int> directed;
  for (size_t i = 0; i < mesh.indices.size(); i += 3) {
    for (size_t k = 0; k < 3; ++k) ++directed[{mesh.indices[i + k], mesh.indices[i + (k + 1) % 3]}];
  }
  for (const auto& [edge, uses] : directed) {
    ASSERT_EQ(uses, 1);
    ASSERT_EQ(directed.count({edge.second, edge.first}), 1u) << edge.first << " to " << edge.second;
  }
}

TEST(CityTest, EveryBoxOwnsEightVerticesAndFacesOut) {
  const ImportedMesh mesh = generate_city(6000, 4);
  ASSERT_EQ(mesh.indices.size() / kBoxIndices * 24, mesh.vertices.size());
  for (size_t box = 0; box < mesh.indices.size() / kBoxIndices; ++box) {
    for (size_t i = box * kBoxIndices; i < (box + 1) * kBoxIndices; ++i) ASSERT_EQ(mesh.indices[i] / 8, box);
    const Bounds bounds = box_bounds(mesh, box);
    double volume = 1;
    for (size_t axis = 0; axis < 3; ++axis) volume *= bounds.max[axis] - bounds.min[axis];
    ASSERT_GT(volume, 0) << box;
    ASSERT_DOUBLE_EQ(six_volumes(mesh, box), 6 * volume) << box;
  }
}

TEST(CityTest, AllCoordinatesAreHalfMetres) {
  const ImportedMesh mesh = generate_city(200'000, 6);
  for (float coordinate : mesh.vertices) ASSERT_EQ(coordinate * 2, std::floor(coordinate * 2));
}

TEST(CityTest, BuildingsStandOnTheGroundOrOnTheirOwnTowerAndDoNotOverlap) {
  const ImportedMesh mesh = generate_city(12'000, 7);
  const size_t boxes = mesh.indices.size() / kBoxIndices;
  const Bounds ground = box_bounds(mesh, 0);
  EXPECT_EQ(ground.max[2], 0);
  size_t steps = 0;
  for (size_t box = 1; box < boxes; ++box) {
    const Bounds here = box_bounds(mesh, box);
    for (size_t axis = 0; axis < 2; ++axis) {
      ASSERT_GE(here.min[axis], ground.min[axis]);
      ASSERT_LE(here.max[axis], ground.max[axis]);
    }
    if (here.min[2] > 0) {
      const Bounds below = box_bounds(mesh, box - 1);
      ASSERT_EQ(here.min[2], below.max[2]);
      ASSERT_GT(here.min[0], below.min[0]);
      ASSERT_LT(here.max[1], below.max[1]);
      ++steps;
    }
    for (size_t other = 1; other < box; ++other) {
      const Bounds there = box_bounds(mesh, other);
      bool apart = false;
      for (size_t axis = 0; axis < 3; ++axis) {
        apart |= here.min[axis] >= there.max[axis] || there.min[axis] >= here.max[axis];
      }
      ASSERT_TRUE(apart) << box << " and " << other;
    }
  }
  EXPECT_GT(steps, 100u);
}

TEST(CityTest, PartsAreGroundAndBuildings) {
  const ImportedMesh mesh = generate_city(240, 8);
  ASSERT_EQ(mesh.parts.size(), 2u);
  EXPECT_EQ(mesh.parts[0].name, "ground");
  EXPECT_EQ(mesh.parts[1].name, "buildings");
  EXPECT_EQ(mesh.parts[1].first_triangle, 12u);
  EXPECT_EQ(generate_city(12, 8).parts.size(), 1u);
}

}  // namespace
}  // namespace locus::cli
