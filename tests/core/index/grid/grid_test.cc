#include "core/index/grid/grid.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory_resource>

#include "core/index/queries/nearest_values.h"
#include "tests/support/finite_grid_comparison.h"

namespace locus::test {
namespace {

static_assert(MutableSpatialIndex<Grid<Triangle>>);
static_assert(MutableSpatialIndex<Grid<Object>>);
static_assert(MutableSpatialIndex<GridOfTrees<Object>>);
static_assert(SpatialIndex<GridOfBvhs<Object>> && !MutableSpatialIndex<GridOfBvhs<Object>>);

constexpr double kBoundless = std::numeric_limits<double>::infinity();
constexpr GridOrder kBothOrders[] = {GridOrder::kXMajor, GridOrder::kMorton};

Object crate_at(Vec3d center, double half, uint32_t id) {
  return value_filling<Object>(center, {half, half, half}, id);
}

// Returns options for cells of 1 m between the origin and `size`.
GridOptions unit_cells(Vec3d size, GridOrder order = GridOrder::kXMajor) {
  GridOptions options;
  options.bounds = {{0, 0, 0}, size};
  options.cell_size = 1;
  options.order = order;
  return options;
}

template <class Index>
std::vector<Id> grid_ids(const Index& index, Vec3d center, Vec3d half) {
  std::vector<Object> found;
  box_overlap(index, {center, half, {}}, found);
  std::vector<Id> ids;
  for (const Object& object : found) ids.push_back(object.id);
  return ids;
}

// Scene with the given values, and with queries at the values and around them.
TestScene<Object> scene_around(const std::vector<Object>& values, double size, Random& random) {
  SceneSketch sketch{"values of a test", {}, {}, {}, {}};
  for (const Object& value : values) sketch.placements.push_back({value.shape.position, {}, {}});
  add_queries(sketch, 30, size, random);
  TestScene<Object> scene = make_scene<Object>(sketch, random);
  scene.values = values;
  return scene;
}

TEST(GridTest, AnswersAsTheListOnRandomScenes) { EXPECT_EQ(search_all_finite_grids(scaled_count(300), 0), ""); }

TEST(GridTest, AnswersAsTheListOnAdversarialScenes) { EXPECT_EQ(search_all_finite_grids(0, scaled_count(150)), ""); }

TEST(GridTest, GridsOfTreesAnswerAsTheList) {
  EXPECT_EQ(search_finite_grids<GridOfTrees<Triangle>>(scaled_count(30), scaled_count(60)), "");
  EXPECT_EQ(search_finite_grids<GridOfTrees<Object>>(scaled_count(30), scaled_count(60)), "");
  EXPECT_EQ(search_finite_grids<GridOfBvhs<Object>>(scaled_count(30), scaled_count(60)), "");
}

TEST(GridTest, GridsOfGridsAnswerAsTheList) {
  using Nested = Grid<Object, PrimitiveTraits<Object>, Grid<Object>>;
  EXPECT_EQ(search_finite_grids<Nested>(scaled_count(30), scaled_count(60)), "");
}

TEST(GridTest, AnEmptyGridAnswersNothing) {
  for (const GridOptions& options : {GridOptions(), unit_cells({4, 4, 4})}) {
    const Grid<Object> grid(options);
    EXPECT_EQ(grid.size(), 0u);
    EXPECT_FALSE(any_ray(grid, ObjectRay(Rayd{{0, 0, 0}, {1, 0, 0}}), kBoundless));
    EXPECT_THAT(grid_ids(grid, {0, 0, 0}, {9, 9, 9}), ::testing::IsEmpty());
    std::vector<ValueAt<Object>> nearest;
    nearest_values(grid, {0, 0, 0}, kBoundless, 3, nearest);
    EXPECT_TRUE(nearest.empty());
  }
  EXPECT_EQ(Grid<Object>::build({}).size(), 0u);
}

TEST(GridTest, StridesArePowersOfTwoAndEachCellHasAnIndexOfItsOwn) {
  for (const GridOrder order : kBothOrders) {
    const GridLayout<double> layout({{0, 0, 0}, {5, 3, 9}}, 1, order);
    EXPECT_EQ(layout.table_size(), 8u * 4 * 16);
    std::vector<size_t> indexes;
    for (int x = 0; x < 5; ++x)
      for (int y = 0; y < 3; ++y)
        for (int z = 0; z < 9; ++z) indexes.push_back(layout.index(x, y, z));
    std::sort(indexes.begin(), indexes.end());
    EXPECT_EQ(std::adjacent_find(indexes.begin(), indexes.end()), indexes.end());
    EXPECT_LT(indexes.back(), layout.table_size());
  }
  const GridLayout<double> x_major({{0, 0, 0}, {5, 3, 9}}, 1, GridOrder::kXMajor);
  EXPECT_EQ(x_major.index(3, 2, 7), 3u + 8 * 2 + 32 * 7);
  const GridLayout<double> morton({{0, 0, 0}, {8, 8, 8}}, 1, GridOrder::kMorton);
  EXPECT_EQ(morton.index(5, 3, 6), 0b101'110'011u);  // x = 101, y = 011, z = 110; the highest bits first, z y x
}

TEST(GridTest, CellsAreDoubledUntilTheyAreFewEnough) {
  const GridLayout<double> layout({{0, 0, 0}, {1e9, 1e9, 1e9}}, 1e-3, GridOrder::kXMajor);
  EXPECT_LE(layout.table_size(), size_t{limits::kMaxGridCells});
  EXPECT_EQ(layout.border(0, layout.count(0)), 1e9);
}

// A box around two neighbouring values, X and Y, is cut by the border between two cells; each part must find both, and
// each is found once (Hughes et al., ch. 37).
TEST(GridTest, ValuesOnABorderAreFoundOnceFromAllSides) {
  for (const GridOrder order : kBothOrders) {
    const std::vector<Object> values = {
        value_filling<Object>({1, 0.5, 0.5}, {0, 0.4, 0.4}, 1),    // X, a wall on the border of two cells
        value_filling<Object>({2, 1.5, 1.5}, {0.7, 0.7, 0.7}, 2),  // Y, in several cells
        value_filling<Object>({2, 2, 2}, {}, 3),                   // at a corner of eight cells
    };
    const auto grid = Grid<Object>::build(values, unit_cells({4, 4, 4}, order));
    EXPECT_EQ(grid.shape().outside, 0u);
    EXPECT_GT(grid.shape().references, 9u);
    EXPECT_THAT(grid_ids(grid, {0.5, 0.5, 0.5}, {0.5, 0.2, 0.2}), ::testing::ElementsAre(1u));
    EXPECT_THAT(grid_ids(grid, {1.25, 0.5, 0.5}, {0.25, 0.2, 0.2}), ::testing::ElementsAre(1u));
    EXPECT_THAT(grid_ids(grid, {2, 2, 2}, {2, 2, 2}), ::testing::UnorderedElementsAre(1u, 2u, 3u));
    for (const Vec3d side : lattice_directions())
      EXPECT_THAT(grid_ids(grid, Vec3d{2, 2, 2} + side * 0.5, abs(side) * 0.5), ::testing::Contains(3u));
    for (const double sign : {1.0, -1.0}) {
      std::vector<RayHit<Object>> hits;
      all_rays(grid, ObjectRay(Rayd{{2 - 9 * sign, 0.55, 0.55}, {sign, sign * 0.02, sign * 0.02}}), kBoundless, 9,
               hits);
      EXPECT_THAT(hits, ::testing::Contains(::testing::Field(&RayHit<Object>::value, values[0])));
    }
  }
}

TEST(GridTest, ALongRowOfCellsLosesNoValue) { EXPECT_EQ(long_row_difference(), ""); }

TEST(GridTest, AShortRayLooksUpOnlyTheCellsNearIt) { EXPECT_EQ(grid_short_ray_fault(), ""); }

TEST(GridTest, ARayEndsBeforeTheCellsBehindItsFirstHit) {
  std::vector<Object> values;
  for (uint32_t i = 0; i < 64; ++i) values.push_back(crate_at({i + 0.5, 0.5, 0.5}, 0.3, i + 1));
  const auto grid = Grid<Object>::build(values, unit_cells({64, 1, 1}));
  for (const double sign : {1.0, -1.0}) {
    Object first;
    double distance = kBoundless;
    Work work;
    const ObjectRay ray(Rayd{{32 - 50 * sign, 0.5, 0.5}, {sign, 0, 0}});
    ASSERT_TRUE(first_ray(grid, ray, first, distance, &work));
    EXPECT_EQ(first.id, sign > 0 ? 1u : 64u);
    EXPECT_LE(work.cells, 2u);
    EXPECT_LE(work.tests, 2u);
  }
}

TEST(GridTest, ComponentsOfMinusZeroLoseNoHit) {
  std::vector<Object> values;
  for (uint32_t i = 0; i < 27; ++i) values.push_back(crate_at({i % 3 + 0.5, i / 3 % 3 + 0.5, i / 9 + 0.5}, 0.4, i + 1));
  const auto grid = Grid<Object>::build(values, unit_cells({3, 3, 3}));
  for (const double zero : {0.0, -0.0}) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double sign : {1.0, -1.0}) {
        for (int i = 0; i < 9; ++i) {
          Rayd ray{{i % 3 + 0.5, i / 3 + 0.5, i % 3 + 0.5}, {zero, zero, zero}};
          ray.origin[axis] = 1.5 - 9 * sign;
          ray.direction[axis] = sign;
          std::vector<RayHit<Object>> hits;
          all_rays(grid, ObjectRay(ray), 20, 9, hits);
          EXPECT_EQ(hits.size(), 3u) << "axis " << axis << ", " << i;
        }
      }
    }
  }
}

TEST(GridTest, ARayAlongABorderFindsTheValuesOnBothSides) {
  const std::vector<Object> values = {value_filling<Object>({1.5, 0.5, 0.5}, {0.5, 0.5, 0.5}, 1),
                                      value_filling<Object>({1.5, 1.5, 0.5}, {0.5, 0.5, 0.5}, 2),
                                      value_filling<Object>({1.5, 0.5, 1.5}, {0.5, 0.5, 0.5}, 3),
                                      value_filling<Object>({1.5, 1.5, 1.5}, {0.5, 0.5, 0.5}, 4)};
  const auto grid = Grid<Object>::build(values, unit_cells({4, 4, 4}));
  std::vector<RayHit<Object>> hits;
  all_rays(grid, ObjectRay(Rayd{{-3, 1, 1}, {1, 0, 0}}), kBoundless, 9, hits);
  EXPECT_EQ(hits.size(), 4u);
}

TEST(GridTest, ValuesOutsideTheBoundsAreInOneList) {
  auto grid = Grid<Object>::build({crate_at({1, 1, 1}, 0.3, 1), crate_at({-5, 1, 1}, 0.3, 2)}, unit_cells({4, 4, 4}));
  grid.insert(crate_at({1e8, -1e7, 3}, 1, 3));
  grid.insert(crate_at({4, 2, 2}, 0.1, 4));
  EXPECT_EQ(grid.shape().outside, 3u);
  EXPECT_THAT(grid_ids(grid, {1e8, -1e7, 3}, {2, 2, 2}), ::testing::ElementsAre(3u));
  EXPECT_THAT(grid_ids(grid, {4.05, 2, 2}, {0.01, 2, 2}), ::testing::ElementsAre(4u));
  EXPECT_TRUE(any_ray(grid, ObjectRay(Rayd{{-5, 1, -9}, {0, 0, 1}}), kBoundless));
  std::vector<ValueAt<Object>> nearest;
  nearest_values(grid, {-9, 1, 1}, kBoundless, 2, nearest);
  ASSERT_EQ(nearest.size(), 2u);
  EXPECT_EQ(nearest[0].value.id, 2u);
  EXPECT_TRUE(grid.remove(crate_at({-5, 1, 1}, 0.3, 2)));
  EXPECT_FALSE(grid.remove(crate_at({-5, 1, 1}, 0.3, 2)));
  EXPECT_EQ(grid.shape().outside, 2u);
}

TEST(GridTest, ValuesInTooManyCellsAreOutsideTheCells) {
  GridOptions options = unit_cells({8, 8, 8});
  options.max_cells_per_value = 27;
  const auto grid = Grid<Object>::build({crate_at({4.5, 4.5, 4.5}, 1, 1), crate_at({4.5, 4.5, 4.5}, 2, 2)}, options);
  EXPECT_EQ(grid.shape().references, 27u + 1);
  EXPECT_EQ(grid.shape().outside, 1u);
  EXPECT_THAT(grid_ids(grid, {4.5, 4.5, 4.5}, {0.1, 0.1, 0.1}), ::testing::UnorderedElementsAre(1u, 2u));
}

TEST(GridTest, AHubInAWideCountryAnswersAsTheList) {
  Random random(7);
  std::vector<Object> values;
  for (uint32_t i = 0; i < 2'000; ++i)
    values.push_back(crate_at(random.vector(i % 20 == 0 ? 1e4 : 1), i % 20 == 0 ? 10 : 0.01, i + 1));
  for (const double size : {0.1, 1e3}) {
    const TestScene<Object> scene = scene_around(values, size, random);
    EXPECT_EQ(grid_difference_with<Grid<Object>>(scene, GridOptions()), "");
    EXPECT_EQ(grid_difference_with<GridOfTrees<Object>>(scene, GridOptions()), "");
  }
}

TEST(GridTest, ValuesOneStepApartAnswerAsTheList) {
  Random random(9);
  std::vector<Object> values;
  for (uint32_t i = 0; i < 40; i += 2) {
    const double border = i / 4;
    values.push_back(value_filling<Object>({border, 1, 1}, {}, i + 1));
    values.push_back(value_filling<Object>({std::nextafter(border, i % 4 == 0 ? 99 : -99), 1, 1}, {}, i + 2));
  }
  for (const GridOrder order : kBothOrders) {
    const TestScene<Object> scene = scene_around(values, 0.5, random);
    EXPECT_EQ(grid_difference_with<Grid<Object>>(scene, unit_cells({10, 2, 2}, order)), "");
    EXPECT_EQ(grid_difference_with<Grid<Object>>(scene, GridOptions()), "");
  }
}

TEST(GridTest, AHundredThousandEqualValuesAreAnsweredInOrder) {
  std::vector<Object> boxes;
  for (uint32_t i = 0; i < 100'000; ++i) boxes.push_back(crate_at({1, 2, 3}, 0.5, i + 1));
  const auto grid = Grid<Object>::build(boxes);
  EXPECT_LE(grid.shape().references, 8 * boxes.size());
  Object first;
  double distance = kBoundless;
  ASSERT_TRUE(first_ray(grid, ObjectRay(Rayd{{1, 2, -9}, {0, 0, 1}}), first, distance));
  EXPECT_EQ(first.id, 1u);
  EXPECT_EQ(grid_ids(grid, {1, 2, 3}, {0.1, 0.1, 0.1}).size(), boxes.size());
  std::vector<ValueAt<Object>> nearest;
  nearest_values(grid, {9, 9, 9}, kBoundless, 2, nearest);
  ASSERT_EQ(nearest.size(), 2u);
  EXPECT_EQ(nearest[1].value.id, 2u);
}

TEST(GridTest, TenThousandRandomInsertsAndRemovesLeaveNoGhost) {
  for (const GridOrder order : kBothOrders) {
    Random random(11);
    const TestScene<Object> queries = make_scene<Object>(random_scene(random), random);
    GridOptions options;
    options.bounds = {{-6, -6, -6}, {6, 6, 6}};
    options.cell_size = 0.75;
    options.order = order;
    Grid<Object> grid(options);
    EXPECT_EQ(drift_difference(grid, scaled_count(10'000), queries, random), "");
    GridOfTrees<Object> nested(options);
    EXPECT_EQ(drift_difference(nested, scaled_count(2'000), queries, random), "");
  }
}

TEST(GridTest, ATicksGridIsAllocatedInItsArena) {
  std::vector<Object> values;
  for (uint32_t i = 0; i < 1'000; ++i)
    values.push_back(crate_at({i % 10 + 0.5, i / 10 % 10 + 0.5, i / 100 + 0.5}, 0.6, i + 1));
  for (int tick = 0; tick < 3; ++tick) {
    std::pmr::monotonic_buffer_resource arena(size_t{1} << 20, std::pmr::new_delete_resource());
    GridOptions options = unit_cells({10, 10, 10});
    options.memory = &arena;
    const auto grid = Grid<Object>::build(values, options);
    // The tables and lists of the grid may not fall back to the default resource while it is built.
    std::pmr::memory_resource* const usual = std::pmr::set_default_resource(std::pmr::null_memory_resource());
    const auto again = Grid<Object>::build(values, options);
    std::pmr::set_default_resource(usual);
    EXPECT_EQ(again.size(), values.size());
    EXPECT_EQ(grid_ids(again, {5, 5, 5}, {0.2, 0.2, 0.2}).size(), 8u);
    EXPECT_EQ(grid_ids(grid, {5, 5, 5}, {0.2, 0.2, 0.2}).size(), 8u);
  }
}

TEST(GridTest, AVisitEndsWhenTheVisitorHasEnough) {
  const auto grid = Grid<Object>::build(
      {crate_at({1, 1, 1}, 0.6, 1), crate_at({1, 1, 1}, 0.6, 2), crate_at({-9, 1, 1}, 1, 3)}, unit_cells({4, 4, 4}));
  Work work;
  EXPECT_TRUE(any_ray(grid, ObjectRay(Rayd{{-2, 1, 1}, {1, 0, 0}}), kBoundless, &work));
  EXPECT_EQ(work.tests, 1u);
}

}  // namespace
}  // namespace locus::test
