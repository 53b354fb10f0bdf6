// Cells of a BspTree: they are convex and fill space, and their order agrees with geometry.
#include "core/index/bsp_tree/bsp_space.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "tests/support/bsp_trials.h"

namespace locus::test {
namespace {

// Returns how far `point` is within the cell: the least distance to its planes, negative outside of the cell.
double depth_in(const std::vector<Plane>& cell, const Vec3d& point) {
  double depth = std::numeric_limits<double>::infinity();
  for (const Plane& plane : cell) depth = std::min(depth, signed_distance(plane, point));
  return depth;
}

TEST(BspSpaceTest, AnUndividedSpaceIsOneCell) {
  const BspSpace space;
  EXPECT_EQ(space.node_count(), 1u);
  EXPECT_EQ(space.depth(), 0u);
  EXPECT_EQ(space.leaf_of({1e9, -1e9, 0}), BspNode::kRoot);
  EXPECT_TRUE(space.planes_around(BspNode::kRoot).empty());
}

TEST(BspSpaceTest, APointOnAPlaneBelongsToItsFront) {
  BspSpace space;
  const uint32_t front = space.divide(BspNode::kRoot, {{1, 0, 0}, -1});
  EXPECT_EQ(space.leaf_of({1, 5, 5}), front);
  EXPECT_EQ(space.leaf_of({std::nextafter(1, 0), 5, 5}), front + 1);
}

TEST(BspSpaceTest, NumbersOfJoinedCellsAreNotUsedAgain) {
  BspSpace space;
  const CellNumber all = space.number(BspNode::kRoot);
  const CellNumber old = space.number(space.divide(BspNode::kRoot, {{1, 0, 0}, -1}));
  space.join(BspNode::kRoot);
  EXPECT_FALSE(space.has_cell(old));
  const CellNumber fresh = space.number(space.divide(BspNode::kRoot, {{0, 1, 0}, 0}));
  EXPECT_NE(fresh, old);
  EXPECT_FALSE(space.has_cell(old));
  EXPECT_TRUE(space.has_cell(fresh));
  EXPECT_EQ(space.number(BspNode::kRoot), all);
  space.clear();
  EXPECT_FALSE(space.has_cell(fresh));
  EXPECT_EQ(space.node_count(), 1u);
}

TEST(BspSpaceDeathTest, TheCellOfAnUnknownNumberIsAProgrammerError) {
  const BspSpace space;
  EXPECT_DEATH(space.node_of(7), "check failed");
}

TEST(BspCellsTest, EveryPointIsInTheCellOfItsLeafAndInNoOther) {
  Random random(1);
  for (const BspTree<Triangle>& tree : trees_of_triangles()) {
    const std::vector<CellNumber> leaves = leaves_from(tree, {});
    EXPECT_EQ(leaves.size(), tree.shape().nodes / 2 + 1);
    std::vector<std::vector<Plane>> cells;
    for (const CellNumber leaf : leaves) cells.push_back(tree.cell_of_leaf(leaf));
    for (int i = 0; i < 100; ++i) {
      const Vec3d point = random.vector(random.chance(0.5) ? 40 : 1e6);
      const CellNumber own = tree.leaf_of(point);
      for (size_t cell = 0; cell < cells.size(); ++cell) {
        if (leaves[cell] == own) {
          ASSERT_GE(depth_in(cells[cell], point), 0) << "point " << i;
        } else {
          ASSERT_LE(depth_in(cells[cell], point), 0) << "point " << i;
        }
      }
    }
  }
}

TEST(BspCellsTest, PointsBetweenTwoPointsOfACellAreInTheCell) {
  Random random(2);
  int found = 0;
  for (const BspTree<Triangle>& tree : trees_of_triangles()) {
    for (int i = 0; i < 2'000; ++i) {
      const Vec3d a = random.vector(40), b = a + random.vector(random.chance(0.5) ? 2 : 20);
      const CellNumber leaf = tree.leaf_of(a);
      if (tree.leaf_of(b) != leaf) continue;
      ++found;
      const Vec3d between = a + (b - a) * random.unit();
      const std::vector<Plane> cell = tree.cell_of_leaf(leaf);
      ASSERT_TRUE(tree.leaf_of(between) == leaf || depth_in(cell, between) > -1e-9) << "turn " << i;
    }
  }
  EXPECT_GT(found, 1'000);
}

TEST(BspCellsTest, TheOrderFromAnEyeNeverGoesBackAlongARay) { EXPECT_EQ(bsp_order_difference(), ""); }

TEST(BspCellsTest, ThePaintersOrderIsTheReverseOfFrontToBack) {
  Random random(4);
  for (const BspTree<Triangle>& tree : trees_of_triangles()) {
    const Vec3d eye = random.vector(40);
    std::vector<CellNumber> forward = leaves_from(tree, eye), backward;
    tree.visit_back_to_front(eye, [&backward](CellNumber leaf) {
      backward.push_back(leaf);
      return true;
    });
    std::reverse(backward.begin(), backward.end());
    EXPECT_EQ(forward, backward);
    std::sort(forward.begin(), forward.end());
    EXPECT_EQ(std::adjacent_find(forward.begin(), forward.end()), forward.end()) << "a leaf was visited twice";
    EXPECT_EQ(tree.leaf_of(eye), backward.front());
  }
}

TEST(BspCellsTest, TheLeavesOnARayFollowEachOtherFromItsStartToItsEnd) {
  Random random(7);
  for (const BspTree<Triangle>& tree : trees_of_triangles()) {
    for (int i = 0; i < 50; ++i) {
      const Rayd ray = {random.vector(40), random.vector(2), random.between(1, 50)};
      double last = 0;
      tree.leaves_on_ray(ray, [&](CellNumber leaf, double begin, double end) {
        EXPECT_NEAR(begin, last, 1e-9);
        EXPECT_LE(begin, end);
        if (end - begin > 1e-6) {
          EXPECT_EQ(tree.leaf_of(ray.origin + ray.direction * ((begin + end) / 2)), leaf);
        }
        last = end;
        return true;
      });
      EXPECT_EQ(last, ray.t_max);
    }
  }
}

TEST(BspCellsTest, VisitsOfLeavesEndWhenTheyAreTold) {
  const BspTree<Triangle> tree = BspTree<Triangle>::build(box_city(4, 1));
  int calls = 0;
  const auto first = [&calls](CellNumber) { return ++calls < 2; };
  tree.visit_front_to_back({}, first);
  EXPECT_EQ(calls, 2);
  tree.visit_back_to_front({}, first);
  EXPECT_EQ(calls, 3);
  tree.leaves_on_ray({{-100, 15, 2}, {1, 0, 0}, 1000}, [&calls](CellNumber, double, double) { return ++calls < 5; });
  EXPECT_EQ(calls, 5);
}

}  // namespace
}  // namespace locus::test
