// Tests of half lines through boxes and trees: the boxes that a half line intersects, the sums of crossings, and the
// choice of the cheapest half line.
#include "core/index/bvh/half_line_boxes.h"

#include <gtest/gtest.h>

#include "tests/support/crossing_trials.h"

namespace locus::test {
namespace {

// Eight boxes, laid out as in TriangleNode::bounds, of which the first is `box` and the others are empty.
struct EightBoxes {
  explicit EightBoxes(const Aabbf& box) {
    for (int axis = 0; axis < 3; ++axis) {
      for (int slot = 0; slot < kTreeWidth; ++slot) {
        bounds[axis][slot] = slot == 0 ? box.min[axis] : 1e30f;
        bounds[axis + 3][slot] = slot == 0 ? box.max[axis] : -1e30f;
      }
    }
  }
  float bounds[6][kTreeWidth];
};

bool meets(Vec3d point, HalfLine line, const Aabbf& box) {
  const uint32_t met = HalfLineBoxes(point, line).boxes_met(EightBoxes(box).bounds);
  EXPECT_EQ(met & ~1u, 0u);
  return met != 0;
}

// Returns whether the half line intersects the box. Compares doubles without any rounding.
bool is_met(Vec3d point, HalfLine line, const Aabbf& box) {
  for (int axis = 0; axis < 3; ++axis) {
    const bool from_min = double{box.min[axis]} <= point[axis], to_max = point[axis] <= double{box.max[axis]};
    if (axis == line.axis ? !(line.descending ? from_min : to_max) : !(from_min && to_max)) return false;
  }
  return true;
}

TEST(HalfLineBoxesTest, AHalfLineMeetsTheSidesOfABoxAndItsOwnStart) {
  const Aabbf box{{-1, -2, -3}, {1, 2, 3}};
  EXPECT_TRUE(meets({-5, 2, -3}, {0, false}, box));
  EXPECT_FALSE(meets({-5, 2, -3}, {0, true}, box));
  EXPECT_TRUE(meets({1, 0, 0}, {0, false}, box));
  EXPECT_FALSE(meets({std::nextafter(1, 2), 0, 0}, {0, false}, box));
  EXPECT_TRUE(meets({-1, 0, 0}, {0, true}, box));
  EXPECT_FALSE(meets({std::nextafter(-1, -2), 0, 0}, {0, true}, box));
  EXPECT_FALSE(meets({0, std::nextafter(2, 3), 0}, {0, true}, box));
  EXPECT_FALSE(meets({0, 0, std::nextafter(-3, -4)}, {1, true}, box));
}

TEST(HalfLineBoxesTest, BoxesAreMetAsInDouble) {
  int met = 0;
  for (uint64_t seed = 0; seed < scaled_count(20'000); ++seed) {
    Random random(seed);
    const Vec3f corner = random.float_vector(random.magnitude(-140, 120));
    const Aabbf box = merge(Aabbf{corner, corner}, corner + random.float_vector(random.magnitude(-140, 120)));
    Vec3d point;
    for (int axis = 0; axis < 3; ++axis) {
      const double side = double{random.chance(0.5) ? box.min[axis] : box.max[axis]};
      point[axis] = random.chance(0.3) ? side : side + random.between(-1, 1) * random.magnitude(-60, 4) * side;
    }
    for (const HalfLine line : kHalfLines) {
      ASSERT_EQ(meets(point, line, box), is_met(point, line, box)) << "seed " << seed;
      met += is_met(point, line, box) ? 1 : 0;
    }
  }
  EXPECT_GT(met, 100);
}

TEST(HalfLineBoxesTest, AVisitSumsTheCrossingsOfAllTriangles) {
  for (const CrossingTrial& trial : all_crossing_trials()) ASSERT_EQ(trial.difference(), "");
}

// Returns the cost of a visit: the number of nodes that it opens plus the number of triangles that it tests.
uint64_t cost_of(const TriangleBvh& tree, Vec3d point, HalfLine line) {
  struct {
    bool visit(const Triangle& /*triangle*/) { return true; }
  } visitor;
  Work work;
  tree.visit_half_line(HalfLineBoxes(point, line), visitor, work);
  return work.nodes + work.tests;
}

TEST(HalfLineBoxesTest, TheCheapestHalfLineMeetsFewBoxes) {
  const absl::StatusOr<TriangleBvh> city = TriangleBvh::build(box_city(12, 1));
  ASSERT_TRUE(city.ok());
  const Aabbd bounds = to_double(city->bounds());
  uint64_t cheapest = 0, fixed[std::size(kHalfLines)] = {};
  Random random(1);
  for (int i = 0; i < 300; ++i) {
    Vec3d point;
    for (int axis = 0; axis < 3; ++axis) point[axis] = random.between(bounds.min[axis], bounds.max[axis]);
    cheapest += cost_of(*city, point, city->cheapest_half_line(point));
    for (size_t k = 0; k < std::size(kHalfLines); ++k) fixed[k] += cost_of(*city, point, kHalfLines[k]);
  }
  // Skip the half lines along z: each of them intersects at most about one house, so they are cheap, too.
  for (size_t k = 0; k < std::size(kHalfLines); ++k) {
    if (kHalfLines[k].axis == 2) continue;
    EXPECT_LT(2 * cheapest, fixed[k]);
  }
}

TEST(HalfLineBoxesTest, TheCheapestHalfLineFromASideLeavesTheBounds) {
  const absl::StatusOr<TriangleBvh> sphere = TriangleBvh::build(bumpy_sphere(10, 0.1, 1));
  ASSERT_TRUE(sphere.ok());
  for (int axis = 0; axis < 3; ++axis) {
    Vec3d point;
    point[axis] = double{sphere->bounds().min[axis]};
    const HalfLine down = sphere->cheapest_half_line(point);
    EXPECT_TRUE(down.axis == axis && down.descending);
    point[axis] = double{sphere->bounds().max[axis]};
    const HalfLine up = sphere->cheapest_half_line(point);
    EXPECT_TRUE(up.axis == axis && !up.descending);
  }
}

}  // namespace
}  // namespace locus::test
