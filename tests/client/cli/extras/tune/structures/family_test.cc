#include "client/cli/extras/tune/structures/family.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>
#include <limits>

#include "client/cli/extras/tune/structures/hash_grid_index.h"
#include "core/index/list/list_index.h"
#include "core/index/queries/index_queries.h"
#include "core/index/queries/nearest_values.h"

namespace locus::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::Pair;
using ::testing::UnorderedElementsAre;

constexpr double kEndless = std::numeric_limits<double>::infinity();

// Triangles on a lattice of 8 x 8 x 8 points, with some that are large.
std::vector<Triangle> lattice() {
  std::vector<Triangle> triangles;
  for (uint32_t i = 0; i < 512; ++i) {
    const Vec3f at = {static_cast<float>(i % 8) * 3, static_cast<float>(i / 8 % 8) * 3, static_cast<float>(i / 64) * 3};
    const float size = i % 37 == 0 ? 9.0f : 1.0f;
    triangles.push_back({at, at + Vec3f{size, 0, 0}, at + Vec3f{0, size, size / 2}, i});
  }
  return triangles;
}

std::vector<PlacedShape> row_of_balls() {
  std::vector<PlacedShape> shapes;
  for (uint64_t i = 1; i <= 300; ++i) {
    Shape ball;
    ball.kind = ShapeKind::kBall;
    ball.position = {3.0 * static_cast<double>(i), 0, 0};
    ball.radius = 1;
    shapes.push_back({i, ball});
  }
  return shapes;
}

FamilyQueries some_queries() {
  FamilyQueries queries;
  for (int i = 0; i < 20; ++i) {
    const double x = i;
    queries.rays.push_back({{x, 1.5, 1}, {1, 0.1, 0.2}, 50});
    queries.balls.push_back({{x, 5, 5}, 3});
    queries.boxes.push_back({{x, 5, 5}, {2, 3, 4}, {}});
    queries.nearest.push_back({{x, -1, 2}, kEndless, 4});
  }
  return queries;
}

absl::Status go_on(uint64_t, uint64_t) { return absl::OkStatus(); }

std::vector<uint32_t> numbers_of(std::vector<Triangle> triangles) {
  std::vector<uint32_t> numbers;
  for (const Triangle& triangle : triangles) numbers.push_back(triangle.number);
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

TEST(FamilyTest, EveryStructureHasTimesOfTheAskedKinds) {
  FamilyQueries queries = some_queries();
  queries.boxes.clear();
  const auto figures = time_shapes(row_of_balls(), queries, {.rounds = 1}, go_on);
  ASSERT_TRUE(figures.ok()) << figures.status();
  std::vector<std::string> names;
  for (const StructureFigures& one : *figures) {
    names.push_back(one.name);
    EXPECT_THAT(one.nanoseconds,
                UnorderedElementsAre(Pair("balls", ::testing::Gt(0)), Pair("nearest", ::testing::Gt(0)),
                                     Pair("rays", ::testing::Gt(0))));
    // Allocators of sanitizers do not count.
    if (mallinfo2().uordblks > 0) {
      EXPECT_GT(one.bytes, 300u * sizeof(Shape)) << one.name;
    }
  }
  EXPECT_THAT(names, ElementsAre("list", "bvh", "hash_grid", "grid", "kd_tree", "octree", "bsp_tree", "sphere_tree"));
  EXPECT_EQ(time_triangles(lattice(), some_queries(), {.rounds = 1}, go_on)->size(), 8u);
}

TEST(FamilyTest, AnErrorOfTheProgressEndsIt) {
  const auto stop = [](uint64_t done, uint64_t) { return done == 3 ? absl::CancelledError("stop") : absl::OkStatus(); };
  EXPECT_TRUE(absl::IsCancelled(time_shapes(row_of_balls(), some_queries(), {.rounds = 1}, stop).status()));
}

TEST(FamilyTest, TheFastestOfEachKindIsTheBest) {
  const StructureFigures figures[] = {{"list", 1, 1, {{"balls", 50}, {"rays", 10}}},
                                      {"bvh", 1, 1, {{"balls", 20}, {"rays", 10}}},
                                      {"grid", 1, 1, {{"balls", 30}, {"rays", 11}}}};
  EXPECT_THAT(best_structures(figures), ElementsAre(Pair("balls", "bvh"), Pair("rays", "list")));
}

TEST(HashGridIndexTest, ItAnswersAsTheList) {
  const std::vector<Triangle> triangles = lattice();
  const HashGridIndex<Triangle> grid(triangles);
  ListIndex<Triangle> list;
  for (const Triangle& triangle : triangles) list.insert(triangle);
  size_t found = 0;
  for (const Balld& ball : some_queries().balls) {
    const Ballf query = {{static_cast<float>(ball.center.x), 5, 5}, 3};
    std::vector<Triangle> by_grid, by_list;
    ball_overlap(grid, query, by_grid);
    ball_overlap(list, query, by_list);
    EXPECT_EQ(numbers_of(by_grid), numbers_of(by_list));
    found += by_list.size();
    std::vector<ValueAt<Triangle>> near_grid, near_list;
    nearest_values(grid, ball.center, kEndless, 5, near_grid);
    nearest_values(list, ball.center, kEndless, 5, near_list);
    for (size_t i = 0; i < 5; ++i) EXPECT_EQ(near_grid[i].value, near_list[i].value);
    Triangle first_grid, first_list;
    float at_grid = 100, at_list = 100;
    const TriangleRay ray({ball.center.x, 1.5, 1}, {1, 0.1, 0.2});
    EXPECT_EQ(first_ray(grid, ray, first_grid, at_grid), first_ray(list, ray, first_list, at_list));
    EXPECT_EQ(at_grid, at_list);
  }
  EXPECT_GT(found, 20u);
}

}  // namespace
}  // namespace locus::cli
