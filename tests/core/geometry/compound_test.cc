#include "core/geometry/compound.h"

#include <gtest/gtest.h>

#include "tests/support/random.h"
#include "tests/support/random_compound.h"

namespace locus {
namespace {

using test::Random;

Part ball_part(Vec3f position, float radius) { return {ShapeKind::kBall, position, {}, {}, radius, kAllLayers}; }

TEST(CompoundTest, PartsAreRotatedAndMovedWithTheirObject) {
  const CompoundPtr compound = Compound::make({ball_part({1, 0, 0}, 0.5f), ball_part({0, 0, 2}, 0.25f)});
  const float half = std::sqrt(0.5f);
  const PlacedCompound placed(*compound, {10, 20, 30}, {0, 0, half, half});  // a quarter turn about z
  const Shape first = placed.shape(0), second = placed.shape(1);
  EXPECT_NEAR(first.position.x, 10, 1e-6);
  EXPECT_NEAR(first.position.y, 21, 1e-6);
  EXPECT_EQ(first.position.z, 30);
  EXPECT_EQ(second.position, (Vec3d{10, 20, 32}));
  EXPECT_EQ(first.radius, 0.5f);
}

TEST(CompoundTest, AnObjectWithoutRotationLeavesPartsAsTheyAre) {
  const CompoundPtr compound = Compound::make({{ShapeKind::kBox, {1, 2, 3}, {0, 0, 0, 1}, {1, 2, 3}, 0, 4}});
  const Shape shape = PlacedCompound(*compound, {}, {}).shape(0);
  EXPECT_EQ(shape, (Shape{ShapeKind::kBox, {1, 2, 3}, {}, {1, 2, 3}, 0}));
}

TEST(CompoundTest, LayersSelectParts) {
  Part head = ball_part({0, 0, 1}, 1), body = ball_part({}, 1);
  head.layers = 2;
  body.layers = 4;
  const CompoundPtr compound = Compound::make({body, head});
  EXPECT_EQ(compound->layers(), 6u);
  std::vector<uint32_t> found;
  PlacedCompound(*compound, {}, {}).for_each(2, [&](const auto& part) {
    found.push_back(part.number());
    return true;
  });
  EXPECT_EQ(found, std::vector<uint32_t>{1});
}

// No rotation of the object takes a point of a part beyond the extent, but for the rounding that indexes allow.
TEST(CompoundTest, ExtentContainsAllPartsUnderEveryRotation) {
  for (uint64_t seed = 0; seed < 300; ++seed) {
    Random random(seed);
    const CompoundPtr compound = test::random_compound(random, random.magnitude(-6, 12));
    const Vec3d position = random.vector(random.magnitude(0, 30));
    const double extent = double{compound->extent()};
    const double growth = 0x1p-38 * (max_component(abs(position)) + extent);
    for (int i = 0; i < 10; ++i) {
      const PlacedCompound placed(*compound, position, random.rotation());
      placed.for_each(kAllLayers, [&](const PlacedCompound::PlacedPart& part) {
        const Aabbd bounds = bounds_of(part.shape()), loose = part.loose_bounds();
        EXPECT_LE(max_component(max(abs(bounds.min - position), abs(bounds.max - position))), extent + growth) << seed;
        EXPECT_EQ(merge(bounds, loose), loose) << seed;
        return true;
      });
    }
  }
}

TEST(CompoundTest, EqualPartsMakeEqualCompounds) {
  EXPECT_EQ(*Compound::make({ball_part({1, 2, 3}, 1)}), *Compound::make({ball_part({1, 2, 3}, 1)}));
  EXPECT_FALSE(*Compound::make({ball_part({1, 2, 3}, 1)}) == *Compound::make({ball_part({1, 2, 3}, 2)}));
}

}  // namespace
}  // namespace locus
