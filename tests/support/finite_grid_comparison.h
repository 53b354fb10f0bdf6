// Comparison of finite grids with the list, for several cell sizes, both orders and nested cells.
#ifndef LOCUS_TESTS_SUPPORT_FINITE_GRID_COMPARISON_H_
#define LOCUS_TESTS_SUPPORT_FINITE_GRID_COMPARISON_H_

#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/index/grid/grid.h"
#include "core/index/octree/octree.h"
#include "tests/support/changed_index.h"
#include "tests/support/grid_scenes.h"
#include "tests/support/scene_search.h"

namespace locus::test {

template <class V>
using GridOfTrees = Grid<V, PrimitiveTraits<V>, Octree<V>>;
template <class V>
using GridOfBvhs = Grid<V, PrimitiveTraits<V>, Bvh<V>>;

// Returns the first difference between a list and grids of the scene's values: one that is built at once, and one that
// is built of the first third of the values and then changed, if it can be changed; empty if there is none.
template <class Index, class V>
std::string grid_difference_with(const TestScene<V>& scene, const GridOptions& options) {
  if (std::string what = first_difference(Index::build(scene.values, options), scene); !what.empty()) return what;
  if constexpr (MutableSpatialIndex<Index>) {
    const auto third = scene.values.begin() + static_cast<ptrdiff_t>(scene.values.size() / 3);
    const std::vector<V> first(scene.values.begin(), third), others(third, scene.values.end());
    auto changed = Index::build(first, options);
    auto list = make_list(first);
    return changed_difference(changed, list, others, scene);
  }
  return "";
}

// Compares grids with a cell size chosen by the grid, and with cells a few of which divide the bounds of the values:
// each scene has values in several cells and values that touch borders.
template <class Index, class V>
std::string finite_grid_difference(const TestScene<V>& scene) {
  GridOptions options;
  if (std::string what = grid_difference_with<Index>(scene, options); !what.empty()) return "chosen cells, " + what;
  Aabbd bounds;
  for (const V& value : scene.values) bounds = merge(bounds, to_double(PrimitiveTraits<V>::bounds(value)));
  const double extent = max_component(bounds.extent());
  options.order = GridOrder::kMorton;
  options.cell_size = extent > 0 ? extent / 8 : 1;
  if (std::string what = grid_difference_with<Index>(scene, options); !what.empty()) return "eight cells, " + what;
  // Bounds and borders at whole numbers of the scene's lattice; some values are outside.
  options.order = GridOrder::kXMajor;
  options.cell_size = std::exp2(std::floor(std::log2(extent > 0 ? extent : 1)) - 3);
  const double corner = std::floor(bounds.min.x / options.cell_size) * options.cell_size;
  options.bounds = {{corner, corner, corner}, {corner, corner, corner}};
  options.bounds.max = options.bounds.max + Vec3d{8, 6, 7} * options.cell_size;
  if (std::string what = grid_difference_with<Index>(scene, options); !what.empty()) return "given bounds, " + what;
  return "";
}

inline SceneSketch finite_grid_scene(uint64_t seed, Random& random) {
  return seed % 2 == 0 ? adversarial_scene(seed / 2, random) : grid_scene(seed / 2, random);
}

template <class Index>
std::string search_finite_grids(uint64_t random_count, uint64_t adversarial_count) {
  using V = typename Index::Value;
  const auto draw_random = [](uint64_t, Random& random) { return random_scene(random); };
  const std::string what = search_scenes<V>(random_count, draw_random, finite_grid_difference<Index, V>);
  return what.empty() ? search_scenes<V>(adversarial_count, finite_grid_scene, finite_grid_difference<Index, V>) : what;
}

inline std::string search_all_finite_grids(uint64_t random_count, uint64_t adversarial_count) {
  std::string what = search_finite_grids<Grid<Triangle>>(random_count, adversarial_count);
  if (what.empty()) what = search_finite_grids<Grid<Object>>(random_count, adversarial_count);
  return what;
}

// Returns the first ray in a row of 20,000 cells, with triangles on some of the borders, that finds other values than
// the list; empty if there is none.
inline std::string long_row_difference() {
  TestScene<Triangle> scene;
  scene.name = "long row of cells";
  for (uint32_t i = 0; i < 40; ++i) {
    const double x = 0.1 * (500 * i + 3);
    scene.values.push_back(value_filling<Triangle>({x, 0.05, 0.05}, {0, 0.05, 0.05}, i + 1));
    scene.values.back().c = {static_cast<float>(x), 0.1f, 0};
    scene.rays.emplace_back(Vec3d{x - 30, 0.05, 0.04}, Vec3d{1, 1e-7, 0});
    scene.rays.emplace_back(Vec3d{x + 40, 0.05, 0.04}, Vec3d{-1, 0, 1e-7});
  }
  GridOptions options;
  options.bounds = {{0, 0, 0}, {2000, 0.1, 0.1}};
  options.cell_size = 0.1;
  return first_difference(Grid<Triangle>::build(scene.values, options), scene);
}

// Returns a message if a short ray looks up about as many cells as a long one; empty if it looks up far fewer.
inline std::string grid_short_ray_fault() {
  GridOptions options;
  options.bounds = {{0, 0, 0}, {64, 64, 64}};
  options.cell_size = 1;
  const auto grid = Grid<Object>::build({value_filling<Object>({60, 2, 2}, {0.1, 0.1, 0.1}, 1)}, options);
  const ObjectRay ray(Rayd{{0.5, 0.5, 0.5}, {1, 0.01, 0.02}});
  Work short_work, long_work;
  any_ray(grid, ray, 2, &short_work);
  any_ray(grid, ray, std::numeric_limits<double>::infinity(), &long_work);
  if (short_work.cells <= 4 && long_work.cells >= 64) return "";
  return absl::StrCat("a short ray looks up ", short_work.cells, " cells, a long one ", long_work.cells);
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_FINITE_GRID_COMPARISON_H_
