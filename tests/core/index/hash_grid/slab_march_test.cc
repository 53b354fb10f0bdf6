// A march along a ray lists slabs of bricks. If a value passes the slab test, its brick is in exactly one slab, and the
// `near` of this slab is at most the `near` of the ray's interval in the value's bounds.
#include "core/index/hash_grid/slab_march.h"

#include <gtest/gtest.h>

#include <limits>
#include <optional>

#include "tests/support/adversarial_scenes.h"
#include "tests/support/test_scale.h"

namespace locus::internal {
namespace {

using test::Random;

struct Filed {
  Aabbd bounds;
  GridKey brick;
};

struct FiledLevel {
  LevelGeometry geometry;
  std::vector<Filed> values;
};

// Returns a level of values that extend up to half a cell beyond their cells; many values are thin and exactly on a
// border between cells.
FiledLevel random_level(Random& random, Vec3d center) {
  FiledLevel level;
  const int exponent = random.whole(-6, 8);
  const double edge = std::exp2(exponent);
  level.geometry.cells_per_unit = cells_per_unit(exponent);
  for (int i = 0; i < 60; ++i) {
    const bool on_border = random.chance(0.5);
    const Vec3d position = center + (on_border ? random.whole_vector(24) * edge : random.vector(24 * edge));
    Vec3d half = random.positive_vector(edge / 2);
    if (random.chance(0.7)) half[static_cast<int>(random.below(3))] = 0;
    const Aabbd bounds{position - half, position + half};
    level.geometry.bounds = merge(level.geometry.bounds, bounds);
    level.geometry.max_extent = std::max(level.geometry.max_extent, extent_of(bounds, position));
    level.values.push_back({bounds, brick_of(cell_of(position, level.geometry.cells_per_unit))});
  }
  return level;
}

// Returns a ray through a corner or a face of the bounds of a random value. Sometimes the ray passes just outside these
// bounds, so that the value passes the slab test only because of the pad.
Rayd grazing_ray(Random& random, const FiledLevel& level, double pad) {
  const Aabbd& box = random.pick(level.values).bounds;
  Vec3d through = random.chance(0.5) ? box.min : box.max;
  const double sliver = pad * magnitude(box);
  for (int axis = 0; axis < 3; ++axis) through[axis] += sliver * random.whole(-2, 2) / 1.01;
  Vec3d direction = random.chance(0.7) ? test::lattice_direction(random) : random.unit_vector();
  if (random.chance(0.2)) direction[static_cast<int>(random.below(3))] *= 1e-12;
  if (direction == Vec3d{}) direction = {0, 0, 1};
  const double back = random.chance(0.3) ? 0 : random.between(0, 100 / level.geometry.cells_per_unit);
  return {through - direction * back, direction * random.magnitude(-20, 20)};
}

bool names(const KeyRange& range, const GridKey& brick) {
  for (int axis = 0; axis < 3; ++axis) {
    if (brick[axis] < range.lo[axis] || brick[axis] > range.hi[axis]) return false;
  }
  return true;
}

// Expects that the brick of each value that passes the slab test is in exactly one slab. Returns the number of these
// values.
int check_march(const FiledLevel& level, const SlabRay<double>& ray, double limit) {
  const SlabMarch march(ray, level.geometry, limit);
  EXPECT_TRUE(std::isfinite(march.bricks()));
  int met = 0;
  for (const Filed& value : level.values) {
    const Interval<double> part = ray.interval(value.bounds);
    if (!(part.near <= part.far && part.far >= 0 && part.near <= limit)) continue;
    ++met;
    int named = 0;
    for (int64_t n = 0; n < march.slabs(); ++n) {
      const SlabMarch::Slab slab = march.slab(n, limit);
      if (!names(slab.bricks, value.brick)) continue;
      ++named;
      EXPECT_LE(slab.near, part.near);
    }
    EXPECT_EQ(named, 1);
  }
  return met;
}

TEST(SlabMarchTest, NamesTheBrickOfEveryMetValueExactlyOnceAndNotTooLate) {
  uint64_t met = 0;
  for (uint64_t seed = 0; seed < test::scaled_count(2'000) && !HasFailure(); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Random random(seed);
    const Vec3d offset = random.chance(0.5) ? Vec3d{} : random.vector(random.magnitude(0, 29));
    const FiledLevel level = random_level(random, offset);
    for (int i = 0; i < 30; ++i) {
      const double pad = random.chance(0.5) ? kObjectPad : kInstancePad;
      const SlabRay<double> ray(grazing_ray(random, level, pad), pad);
      const double end = random.between(0, 100) / (level.geometry.cells_per_unit * max_component(abs(ray.direction())));
      met += check_march(level, ray, random.chance(0.5) ? std::numeric_limits<double>::infinity() : end);
    }
  }
  EXPECT_GT(met, test::scaled_count(2'000) * 30);
}

TEST(SlabMarchTest, ARayThatMissesTheLevelOrEndsBeforeItHasNoSlabs) {
  const LevelGeometry level{{{0, 0, 0}, {10, 10, 10}}, 1, 1};
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(SlabMarch(SlabRay<double>({{-5, 20, 5}, {1, 0, 0}}, kObjectPad), level, infinity).slabs(), 0);
  EXPECT_EQ(SlabMarch(SlabRay<double>({{-5, 5, 5}, {-1, 0, 0}}, kObjectPad), level, infinity).slabs(), 0);
  EXPECT_EQ(SlabMarch(SlabRay<double>({{-5, 5, 5}, {1, 0, 0}}, kObjectPad), level, 4).slabs(), 0);
  EXPECT_GT(SlabMarch(SlabRay<double>({{-5, 5, 5}, {1, 0, 0}}, kObjectPad), level, 5).slabs(), 0);
}

TEST(SlabMarchTest, SlabsComeFromNearToFarInEitherDirection) {
  const LevelGeometry level{{{-100, -100, -100}, {100, 100, 100}}, 0.5, 1};
  for (const double sign : {-1.0, 1.0}) {
    const SlabRay<double> ray({{sign * -150, 3, 5}, {sign, 0.3, -0.1}}, kObjectPad);
    const SlabMarch march(ray, level, std::numeric_limits<double>::infinity());
    ASSERT_GE(march.slabs(), 50);
    double near = -1;
    for (int64_t n = 0; n < march.slabs(); ++n) {
      const SlabMarch::Slab slab = march.slab(n, std::numeric_limits<double>::infinity());
      EXPECT_GE(slab.near, near);
      EXPECT_LE(slab.bricks.count(), 9);
      near = slab.near;
    }
  }
}

TEST(SlabMarchTest, ARayWhoseBoundsOverflowReportsInfiniteBricks) {
  const LevelGeometry level{{{-100, -100, -100}, {100, 100, 100}}, 0.5, 1};
  const SlabRay<double> ray({{0, 0, 0}, {1e-320, 0, 0}}, kObjectPad);
  EXPECT_EQ(SlabMarch(ray, level, std::numeric_limits<double>::infinity()).bricks(),
            std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace locus::internal
