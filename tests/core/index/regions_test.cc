#include "core/index/regions.h"

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace locus::test {
namespace {

template <class S>
Vec3<S> rounded(Vec3d v) {
  return {static_cast<S>(v.x), static_cast<S>(v.y), static_cast<S>(v.z)};
}

template <class S>
Aabb<S> random_box(Random& random, double size) {
  const Vec3d low = random.vector(size);
  return {rounded<S>(low), rounded<S>(low + random.positive_vector(random.magnitude(-8, 0) * size))};
}

// Returns a box that contains `box`. Coordinates that differ from those of `box` are often only one representable
// number away.
template <class S>
Aabb<S> superset(const Aabb<S>& box, Random& random) {
  constexpr S kInf = std::numeric_limits<S>::infinity();
  Aabb<S> larger = box;
  for (int axis = 0; axis < 3; ++axis) {
    if (random.chance(0.3)) larger.min[axis] = std::nextafter(larger.min[axis], -kInf);
    if (random.chance(0.3)) larger.max[axis] = std::nextafter(larger.max[axis], kInf);
    if (random.chance(0.1)) larger.max[axis] += static_cast<S>(random.unit());
  }
  return larger;
}

template <class S>
class RegionsTest : public ::testing::Test {
 protected:
  // Checks with random boxes: each box that overlaps the region overlaps region.bounds(), and each superset of such a
  // box overlaps the region. Returns the number of boxes that overlap the region.
  template <class Region>
  static int expect_monotone_and_bounded(const Region& region, Random& random, double size) {
    int reached = 0;
    for (int i = 0; i < 40; ++i) {
      const Aabb<S> box = random_box<S>(random, size);
      if (!region.overlaps(box)) continue;
      ++reached;
      EXPECT_TRUE(overlaps(box, region.bounds()));
      EXPECT_TRUE(region.overlaps(superset(box, random)));
    }
    return reached;
  }
};

using Scalars = ::testing::Types<float, double>;
TYPED_TEST_SUITE(RegionsTest, Scalars);

TYPED_TEST(RegionsTest, BallsAreMonotoneAndWithinTheirBounds) {
  int reached = 0;
  for (uint64_t seed = 0; seed < 2'000; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const double size = random.magnitude(-10, 30);
    const auto radius = static_cast<TypeParam>(random.chance(0.2) ? 0 : random.unit() * size);
    const BallRegion<TypeParam> region({rounded<TypeParam>(random.vector(size)), radius});
    reached += this->expect_monotone_and_bounded(region, random, size);
  }
  EXPECT_GT(reached, 1'000);
}

TYPED_TEST(RegionsTest, BoxesAreMonotoneAndWithinTheirBounds) {
  int reached = 0;
  for (uint64_t seed = 0; seed < 2'000; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const double size = random.magnitude(-10, 30);
    const Rotation rotation = random.chance(0.5) ? Rotation{} : rotation_of(random.rotation());
    const BoxRegion<TypeParam> region(Obb<TypeParam>{rounded<TypeParam>(random.vector(size)),
                                                     rounded<TypeParam>(random.positive_vector(size)), rotation});
    reached += this->expect_monotone_and_bounded(region, random, size);
  }
  EXPECT_GT(reached, 1'000);
}

TYPED_TEST(RegionsTest, ABallTouchesABoxAtItsRadius) {
  const BallRegion<TypeParam> region({{0, 0, 0}, 5});
  EXPECT_TRUE(region.overlaps({{3, 4, 0}, {9, 9, 9}}));
  EXPECT_FALSE(region.overlaps({{3, 4, TypeParam{1} / 1024}, {9, 9, 9}}));
}

TYPED_TEST(RegionsTest, ABoxWhoseSquaredGapUnderflowsOverlapsTheBoundsToo) {
  const BallRegion<TypeParam> region({{0, 0, 0}, 0});
  const TypeParam tiny = -std::numeric_limits<TypeParam>::denorm_min();
  const Aabb<TypeParam> box{{-1, 0, 0}, {tiny, 0, 0}};
  EXPECT_EQ(region.overlaps(box), overlaps(box, region.bounds()) && region.overlaps(box));
}

TEST(RegionsTest, BoundsOfAFloatBoxRoundOutward) {
  // In float, 16777216 + 1 rounds back to 16777216, so a bound that is not rounded outward would not contain the box's
  // end at 16777217.
  const BoxRegion<float> region(Obbf{{16777216, 0, 0}, {1, 1, 1}, {}});
  EXPECT_GE(region.bounds().max.x, 16777217.0);
  EXPECT_TRUE(region.overlaps({{16777216, 0, 0}, {16777218, 1, 1}}));
}

}  // namespace
}  // namespace locus::test
