// Winding numbers around cells and points of closed meshes, compared with the sums over all triangles.
#include "core/index/bvh/winding_cells.h"

#include <gtest/gtest.h>

#include "core/index/bvh/kernels/dispatch.h"
#include "tests/support/crossing_trials.h"

namespace locus::test {
namespace {

TEST(WindingCellsTest, SearchesThatEndAtClearCellsEqualTheSumsOfAllTriangles) {
  for (const CrossingTrial& trial : closed_crossing_trials())
    ASSERT_EQ(trial.difference_with_cells(active_crossing_kernels()), "");
}

TEST(WindingCellsTest, MostPointsNeedNoSearch) {
  const absl::StatusOr<TriangleBvh> sphere = TriangleBvh::build(bumpy_sphere(40, 0.1, 1));
  ASSERT_TRUE(sphere.ok());
  const WindingCells cells = WindingCells::build(*sphere);
  const Aabbd bounds = to_double(sphere->bounds());
  Random random(1);
  int known = 0, inside = 0, ending = 0;
  for (int i = 0; i < 1'000; ++i) {
    Vec3d point;
    for (int axis = 0; axis < 3; ++axis) point[axis] = random.between(bounds.min[axis], bounds.max[axis]);
    const WindingWay way = cells.way_from(*sphere, point);
    known += way.is_known ? 1 : 0;
    inside += way.is_known && way.winding == 1 ? 1 : 0;
    ending += !way.is_known && std::isfinite(way.end) ? 1 : 0;
  }
  EXPECT_GT(known, 600);
  EXPECT_GT(inside, 200);
  EXPECT_GT(ending, (1'000 - known) / 2);
}

TEST(WindingCellsTest, PointsOutsideTheBoundsAreOutside) {
  const absl::StatusOr<TriangleBvh> sphere = TriangleBvh::build(bumpy_sphere(10, 0.1, 1));
  ASSERT_TRUE(sphere.ok());
  const WindingCells cells = WindingCells::build(*sphere);
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1e300, 1e300}) {
      Vec3d point;
      point[axis] = side;
      const WindingWay way = cells.way_from(*sphere, point);
      EXPECT_TRUE(way.is_known);
      EXPECT_EQ(way.winding, 0);
    }
  }
}

TEST(WindingCellsTest, WithoutCellsTheWayLeadsOutOfTheMesh) {
  const absl::StatusOr<TriangleBvh> sphere = TriangleBvh::build(bumpy_sphere(10, 0.1, 1));
  ASSERT_TRUE(sphere.ok());
  const WindingWay way = WindingCells().way_from(*sphere, {0, 0, 0});
  EXPECT_FALSE(way.is_known);
  EXPECT_EQ(way.winding, 0);
  EXPECT_TRUE(std::isinf(way.end));
  EXPECT_EQ(std::signbit(way.end), way.line.descending);
}

TEST(WindingCellsTest, AByteIsAllocatedForEachOfFourCellsATriangle) {
  const absl::StatusOr<TriangleBvh> sphere = TriangleBvh::build(bumpy_sphere(40, 0.1, 1));
  ASSERT_TRUE(sphere.ok());
  const size_t bytes = WindingCells::build(*sphere).bytes();
  EXPECT_GT(bytes, 2 * sphere->size());
  EXPECT_LT(bytes, 5 * sphere->size());
  EXPECT_EQ(WindingCells().bytes(), 3 * sizeof(float));
}

}  // namespace
}  // namespace locus::test
