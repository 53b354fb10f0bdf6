#include "core/index/bvh/box_distances.h"

#include <gtest/gtest.h>

#include "core/geometry/triangle.h"
#include "tests/support/random.h"

namespace locus::test {
namespace {

struct Eight {
  Triangle triangles[kTreeWidth];
  float bounds[6][kTreeWidth];
  float vertices[9][kTreeWidth];
};

Eight random_eight(Random& random, double extent, double size) {
  Eight eight;
  const Vec3d near = random.vector(extent);
  for (int i = 0; i < kTreeWidth; ++i) {
    Triangle& t = eight.triangles[i];
    for (Vec3f* vertex : {&t.a, &t.b, &t.c}) *vertex = to_float(near + random.vector(size));
    const Aabbf box = bounds_of(t);
    for (int axis = 0; axis < 3; ++axis) {
      eight.bounds[axis][i] = box.min[axis];
      eight.bounds[3 + axis][i] = box.max[axis];
      eight.vertices[axis][i] = t.a[axis];
      eight.vertices[3 + axis][i] = t.b[axis];
      eight.vertices[6 + axis][i] = t.c[axis];
    }
  }
  return eight;
}

// The limit is the distance to one of the boxes, computed in double. A box whose distance in double is within the limit
// must not be culled in float. Positions and sizes range over many powers of two.
TEST(BoxDistancesTest, NoBoxWithinTheLimitInDoubleIsCulledInFloat) {
  constexpr uint64_t kSeed = 61;
  Random random(kSeed);
  int culled = 0;
  for (int i = 0; i < 50000; ++i) {
    const double extent = random.magnitude(-20, 30), size = extent * random.magnitude(-24, 2);
    const Eight eight = random_eight(random, extent, size);
    const Vec3d point = to_double(eight.triangles[0].a) + random.vector(size * random.magnitude(-10, 20));
    const BoxDistances distances(point);
    float to_boxes[kTreeWidth], to_triangles[kTreeWidth];
    distances.to_boxes(eight.bounds, to_boxes);
    distances.to_triangles(eight.vertices, to_triangles);
    for (const Triangle& chosen : eight.triangles) {
      const double limit = squared_distance(point, to_double(bounds_of(chosen)));
      for (int slot = 0; slot < kTreeWidth; ++slot) {
        const double exact = squared_distance(point, to_double(bounds_of(eight.triangles[slot])));
        ASSERT_EQ(to_boxes[slot], to_triangles[slot]) << "seed " << kSeed << " case " << i;
        if (exact <= limit) {
          ASSERT_LE(to_boxes[slot], distances.limit(limit)) << "seed " << kSeed << " case " << i;
        } else {
          culled += to_boxes[slot] > distances.limit(limit);
        }
      }
    }
  }
  EXPECT_GT(culled, 100000);
}

TEST(BoxDistancesTest, NoBoxIsBeyondAnInfiniteLimit) {
  const BoxDistances distances({1e20, -1e20, 3});
  float bounds[6][kTreeWidth] = {};
  for (auto& row : bounds) std::fill(row, row + kTreeWidth, 1e21f);
  float squared_distances[kTreeWidth];
  distances.to_boxes(bounds, squared_distances);
  for (const float squared : squared_distances)
    EXPECT_LE(squared, distances.limit(std::numeric_limits<double>::infinity()));
}

}  // namespace
}  // namespace locus::test
