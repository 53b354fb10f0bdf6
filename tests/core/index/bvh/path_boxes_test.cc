#include "core/index/bvh/path_boxes.h"

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace locus {
namespace {

using test::Random;

Aabbf random_box(Random& random, double size) {
  const Vec3f a = to_float(random.vector(size)), b = to_float(random.vector(size));
  return {min(a, b), max(a, b)};
}

TEST(PathBoxesTest, APathEntersTheBoxGrownByItsExtent) {
  const PathBoxes path({0, 0, 0}, {1, 0, 0}, {1, 2, 0.5}, 20);
  EXPECT_NEAR(*path.entry({{10, 0, 0}, {12, 0, 0}}), 9, 1e-4);
  EXPECT_TRUE(path.entry({{10, 2, 0}, {12, 3, 0}}).has_value());
  EXPECT_FALSE(path.entry({{10, 2.1f, 0}, {12, 3, 0}}).has_value());
  EXPECT_FALSE(path.entry({{10, 0, 0.6f}, {12, 0, 1}}).has_value());
  EXPECT_FALSE(path.entry({{-12, 0, 0}, {-10, 0, 0}}).has_value());
  EXPECT_LE(*path.entry({{-1, 0, 0}, {0, 0, 0}}), 0);
}

TEST(PathBoxesTest, NoBoxIsCulledIfABoxInsideItIsEntered) {
  constexpr uint64_t kSeed = 191;
  Random random(kSeed);
  int entered = 0;
  for (int i = 0; i < 20000; ++i) {
    const double size = random.magnitude(-20, 20);
    Vec3d direction = random.unit_vector();
    if (random.chance(0.2)) direction = {1, 0, 0};
    const PathBoxes path(random.vector(size), direction, abs(random.vector(size * 0.1)), static_cast<float>(2 * size));
    const Aabbf inner = random_box(random, size), outer = merge(inner, random_box(random, size));
    const std::optional<float> near = path.entry(inner), outer_near = path.entry(outer);
    if (!near) continue;
    ++entered;
    ASSERT_TRUE(outer_near.has_value()) << "seed " << kSeed << " case " << i;
    ASSERT_LE(*outer_near, *near) << "seed " << kSeed << " case " << i;
  }
  EXPECT_GT(entered, 1000);
}

TEST(PathBoxesTest, EightBoxesAtOnceGiveTheSameBits) {
  constexpr uint64_t kSeed = 192;
  Random random(kSeed);
  for (int i = 0; i < 2000; ++i) {
    const PathBoxes path(random.vector(10), random.unit_vector(), abs(random.vector(2)), 20);
    float vertices[9][kTreeWidth], nears[kTreeWidth];
    Aabbf boxes[kTreeWidth];
    for (int slot = 0; slot < kTreeWidth; ++slot) {
      for (int corner = 0; corner < 3; ++corner) {
        const Vec3f vertex = to_float(random.vector(10));
        boxes[slot] = merge(boxes[slot], vertex);
        for (int axis = 0; axis < 3; ++axis) vertices[3 * corner + axis][slot] = vertex[axis];
      }
    }
    path.to_triangles(vertices, nears);
    for (int slot = 0; slot < kTreeWidth; ++slot)
      ASSERT_EQ(nears[slot], path.entry(boxes[slot]).value_or(PathBoxes::kMissed)) << "seed " << kSeed << " case " << i;
  }
}

}  // namespace
}  // namespace locus
