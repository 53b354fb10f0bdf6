// Grids answer as the list does, bit for bit, whatever their cell size, the order and batches in which values came, and
// what was there before.
#include <gtest/gtest.h>

#include "core/index/hash_grid/hash_grid.h"
#include "tests/support/grid_scenes.h"
#include "tests/support/index_judge.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

using Grid = HashGrid<Object>;
using List = ListIndex<Object>;
using Scene = TestScene<Object>;

HashGridOptions random_options(Random& random) {
  HashGridOptions options;
  options.cell_size = random.magnitude(-6, 12);
  if (random.chance(0.3)) options.first_choice = 1 + random.below(20);
  return options;
}

// The same values filed in one batch at the given cell size, and one by one at another.
std::string first_difference_of_grids(const Scene& scene, Random& random) {
  const List list = make_list(scene.values);
  Grid bulk(random_options(random));
  bulk.apply({}, scene.values);
  if (std::string what = IndexJudge(bulk, list).difference(scene); !what.empty()) return "in one batch: " + what;
  Grid single(random_options(random));
  for (const Object& object : scene.values) single.insert(object);
  if (std::string what = IndexJudge(single, list).difference(scene); !what.empty()) return "one by one: " + what;
  return "";
}

// Puts each object where another one is, so that it fits the queries of the scene, or a little beside.
Object moved(const Object& object, const std::vector<Object>& objects, Random& random) {
  Object result = object;
  result.shape.position = random.pick(objects).shape.position;
  if (random.chance(0.5)) result.shape.position[static_cast<int>(random.below(3))] *= random.between(0.5, 1);
  if (random.chance(0.2)) result.shape = random.pick(objects).shape;
  return result;
}

// Random batches of inserts, moves and removes with the list in lockstep; snapshots kept along the way must go on to
// answer as the list did when they were taken.
class Lockstep {
 public:
  Lockstep(const Scene& scene, Random& random) : scene_(scene), random_(random), grid_(random_options(random)) {}

  std::string run(int batches) {
    std::vector<std::pair<Grid, List>> kept;
    for (int batch = 0; batch < batches; ++batch) {
      if (random_.chance(0.3)) kept.emplace_back(grid_.snapshot(), list_);
      apply_batch();
      if (std::string what = difference(grid_, list_); !what.empty()) return "batch " + std::to_string(batch) + what;
    }
    for (const auto& [grid, list] : kept) {
      if (std::string what = difference(grid, list); !what.empty()) return "a snapshot" + what;
    }
    return "";
  }

 private:
  static std::string difference(const Grid& grid, const List& list, const Scene& scene) {
    const std::string what = IndexJudge(grid, list).difference(scene);
    if (!what.empty()) return ": " + what;
    size_t present = 0;
    for (const Object& object : list.values()) present += grid.contains(object);
    return present == list.size() ? "" : ": an object is not where contains() looks";
  }
  std::string difference(const Grid& grid, const List& list) const { return difference(grid, list, scene_); }

  void apply_batch() {
    std::vector<Object> removed, inserted;
    for (const Object& object : scene_.values) {
      const Object* here = find(object.id);
      const double choice = random_.unit();
      if (here == nullptr) {
        if (choice < 0.4) inserted.push_back(object);
        continue;
      }
      if (choice < 0.4) removed.push_back(*here);
      if (choice < 0.25) inserted.push_back(moved(*here, scene_.values, random_));
    }
    random_.shuffle(inserted);
    for (const Object& object : removed) list_.remove(object);
    for (const Object& object : inserted) list_.insert(object);
    if (random_.chance(0.5)) {
      grid_.apply(removed, inserted);
      return;
    }
    for (const Object& object : removed) EXPECT_TRUE(grid_.remove(object));
    for (const Object& object : inserted) grid_.insert(object);
  }

  const Object* find(Id id) const {
    for (const Object& object : list_.values()) {
      if (object.id == id) return &object;
    }
    return nullptr;
  }

  const Scene& scene_;
  Random& random_;
  Grid grid_;
  List list_;
};

TEST(HashGridEqualsListTest, OnRandomScenes) {
  for (uint64_t seed = 0; seed < scaled_count(10'000); ++seed) {
    Random random(seed);
    const Scene scene = make_scene<Object>(random_scene(random), random);
    ASSERT_EQ(first_difference_of_grids(scene, random), "") << "seed " << seed;
  }
}

TEST(HashGridEqualsListTest, OnAdversarialScenes) {
  for (uint64_t seed = 0; seed < scaled_count(2'400); ++seed) {
    Random random(seed);
    const Scene scene = make_scene<Object>(adversarial_scene(seed, random), random);
    ASSERT_EQ(first_difference_of_grids(scene, random), "") << "seed " << seed;
  }
}

TEST(HashGridEqualsListTest, OnScenesMadeToBreakGrids) {
  for (uint64_t seed = 0; seed < scaled_count(2'000); ++seed) {
    Random random(seed);
    const Scene scene = make_scene<Object>(grid_scene(seed, random), random);
    ASSERT_EQ(first_difference_of_grids(scene, random), "") << "seed " << seed;
  }
}

TEST(HashGridEqualsListTest, ThroughRandomInsertsMovesAndRemoves) {
  for (uint64_t seed = 0; seed < scaled_count(300); ++seed) {
    Random random(seed);
    const SceneSketch sketch = seed % 2 == 0 ? adversarial_scene(seed / 2, random) : grid_scene(seed / 2, random);
    Scene scene = make_scene<Object>(sketch, random);
    scene.rays.resize(std::min<size_t>(scene.rays.size(), 12), scene.rays.front());
    ASSERT_EQ(Lockstep(scene, random).run(12), "") << "seed " << seed;
  }
}

// Large enough for marches through many bricks, for several levels of many bricks each and for choices of cell size.
TEST(HashGridEqualsListTest, OnTensOfThousandsOfObjects) {
  for (uint64_t seed = 0; seed < scaled_count(20); ++seed) {
    Random random(seed);
    SceneSketch sketch{"a crowd", {}, {}, {}, {}};
    const double ladder = seed % 4 == 3 ? 8 : 0;
    for (int i = 0; i < 20'000; ++i) {
      const double size = 0.5 * random.magnitude(-ladder, ladder / 2);
      const Vec3d town = {1000.0 * random.whole(0, 1), -1000, 50};
      const Vec3d center = seed % 2 == 0 ? random.vector(1000) : town + random.vector(60);
      sketch.placements.push_back({center, random.positive_vector(size), random.rotation()});
    }
    add_queries(sketch, 10, 40, random);
    Scene scene = make_scene<Object>(sketch, random);
    HashGridOptions options;
    if (seed % 3 == 0) options.first_choice = static_cast<size_t>(-1);
    Grid grid(options);
    const absl::Span<const Object> all(scene.values);
    for (size_t i = 0; i < 10; ++i) grid.apply({}, all.subspan(i * 2'000, 2'000));
    ASSERT_EQ(first_difference(grid, scene), "") << "seed " << seed;
  }
}

}  // namespace
}  // namespace locus::test
