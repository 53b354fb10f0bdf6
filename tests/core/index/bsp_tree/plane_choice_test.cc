#include "core/index/bsp_tree/plane_choice.h"

#include <gtest/gtest.h>

#include <vector>

namespace locus::test {
namespace {

// Returns `count` cubes of size 1 in a row along an axis, 10 apart.
std::vector<Aabbd> row(int axis, int count) {
  std::vector<Aabbd> boxes;
  for (int i = 0; i < count; ++i) {
    Vec3d corner;
    corner[axis] = 10 * i;
    boxes.push_back({corner, corner + Vec3d{1, 1, 1}});
  }
  return boxes;
}

TEST(PlaneChoiceTest, ARowIsDividedInTheMiddleAcrossItsAxis) {
  for (int axis = 0; axis < 3; ++axis) {
    const std::optional<Division> division = choose_division(row(axis, 10), {}, BspPlanes::kBest);
    ASSERT_TRUE(division);
    EXPECT_EQ(division->plane.normal[axis], 1);
    EXPECT_EQ(division->front + division->back, 10u);
    EXPECT_GE(std::min(division->front, division->back), 4u);
  }
}

TEST(PlaneChoiceTest, EqualBoxesAreNotDivided) {
  const std::vector<Aabbd> boxes(100, Aabbd{{0, 0, 0}, {1, 1, 1}});
  EXPECT_FALSE(choose_division(boxes, {}, BspPlanes::kBest));
}

TEST(PlaneChoiceTest, BoxesOnALineAreDividedThoughTheyHaveNoArea) {
  std::vector<Aabbd> points;
  for (int i = 0; i < 9; ++i) points.push_back({{0, 0, double(i)}, {0, 0, double(i)}});
  const std::optional<Division> division = choose_division(points, {}, BspPlanes::kAxes);
  ASSERT_TRUE(division);
  EXPECT_EQ(division->plane.normal, (Vec3d{0, 0, 1}));
}

TEST(PlaneChoiceTest, AnOfferedPlaneIsUsedAsTheOptionSays) {
  const std::vector<Plane> offered = {normalized_plane({1, 0.25, 0}, -25)};
  const std::vector<Aabbd> boxes = row(0, 8);
  EXPECT_EQ(choose_division(boxes, offered, BspPlanes::kValues)->plane.normal, offered[0].normal);
  EXPECT_EQ(choose_division(boxes, offered, BspPlanes::kAxes)->plane.normal, (Vec3d{1, 0, 0}));
}

TEST(PlaneChoiceTest, AnOfferedPlaneThatLeavesAllOnOneSideIsReplacedByAnAxis) {
  const std::vector<Plane> offered = {{{1, 0, 0}, 100}};
  const std::optional<Division> division = choose_division(row(0, 8), offered, BspPlanes::kValues);
  ASSERT_TRUE(division);
  EXPECT_NE(division->plane.offset, 100);
}

}  // namespace
}  // namespace locus::test
