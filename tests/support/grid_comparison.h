// Comparison of hash grids with a list (ListIndex, which tests every value). Used by the random tests, which expect no
// difference, and by the tests of planted bugs, which expect a difference. Every function with a parameter `random`
// takes all random numbers from it.
#ifndef LOCUS_TESTS_SUPPORT_GRID_COMPARISON_H_
#define LOCUS_TESTS_SUPPORT_GRID_COMPARISON_H_

#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/index/hash_grid/region_walk.h"
#include "tests/support/grid_scenes.h"
#include "tests/support/index_judge.h"
#include "tests/support/object_grid.h"

namespace locus::test {

using ObjectList = ListIndex<Object>;
using ObjectScene = TestScene<Object>;

inline HashGridOptions random_grid_options(Random& random) {
  HashGridOptions options;
  options.cell_size = random.magnitude(-6, 12);
  if (random.chance(0.3)) options.first_choice = 1 + random.below(20);
  if (random.chance(0.5)) options.min_brick_values = random.between(1, 4);
  return options;
}

// Compares two grids with a list of the same objects. The objects are inserted into the first grid in one batch, and
// one by one into the second grid, which has another cell size.
inline std::string grid_difference(const ObjectScene& scene, Random& random) {
  const ObjectList list = make_list(scene.values);
  ObjectGrid bulk(random_grid_options(random));
  bulk.apply({}, scene.values);
  if (std::string what = IndexJudge(bulk, list).difference(scene); !what.empty()) return "in one batch: " + what;
  ObjectGrid single(random_grid_options(random));
  for (const Object& object : scene.values) single.insert(object);
  if (std::string what = IndexJudge(single, list).difference(scene); !what.empty()) return "one by one: " + what;
  return "";
}

// Tests each ball in three ways: by a visit of the ball alone, in a RegionWalk of all balls, and in a RegionWalk of the
// balls' bounds only. Each way must find as many objects as a test of all objects finds, and the grid must know only
// those positions to be inside a ball or box that are inside. Uses the balls of the scene and balls that just touch
// objects of the scene.
inline std::string grid_ball_difference(const ObjectScene& scene, Random& random) {
  ObjectGrid grid(random_grid_options(random));
  grid.apply({}, scene.values);
  std::vector<Balld> balls = scene.balls;
  for (int i = 0; i < 20 && !scene.values.empty(); ++i) {
    const Shape& shape = random.pick(scene.values).shape;
    const Vec3d toward = random.unit_vector();
    const double away = random.magnitude(-10, 20), reach = shape.kind == ShapeKind::kBall ? double{shape.radius} : 0;
    balls.push_back({shape.position + toward * (away + reach), away});
  }
  const GridSnapshot snapshot = grid.snapshot().grid();
  RegionWalk walk(0, balls.size(), [&](size_t i) {
    return GridRegion{&snapshot, bounds_of(balls[i]), balls[i], nullptr, Marks::kInside};
  });
  RegionWalk wide_walk(0, balls.size(), [&](size_t i) {
    return GridRegion{&snapshot, bounds_of(balls[i]), {}, nullptr, Marks::kInside};
  });
  for (const Balld& ball : balls) {
    size_t expected = 0;
    for (const Object& object : scene.values) expected += ball_overlaps(ball, object.shape) ? 1 : 0;
    const auto by_ball = [&ball](const GridRef& value) { return ball_overlaps(ball, shape_of(value)); };
    const auto by_bounds = [&ball](const GridRef& value) { return contains(bounds_of(ball), value.entry().position); };
    size_t wrongly_inside = 0;
    const auto found_by = [&](const auto& visit_all, const auto& is_inside) {
      size_t found = 0;
      Work work;
      visit_all(work, [&](const GridRef& value) {
        found += by_ball(value) ? 1 : 0;
        wrongly_inside += value.is_inside() && !is_inside(value) ? 1 : 0;
        return true;
      });
      return found;
    };
    const size_t alone = found_by(
        [&](Work& work, const auto& visit) { snapshot.visit_ball(ball, bounds_of(ball), work, visit, Marks::kInside); },
        by_ball);
    const size_t walked = found_by([&](Work& work, const auto& visit) { walk.visit(work, visit); }, by_ball);
    const size_t wide = found_by([&](Work& work, const auto& visit) { wide_walk.visit(work, visit); }, by_bounds);
    if (wrongly_inside != 0) return absl::StrCat("the grid takes ", wrongly_inside, " positions outside for inside");
    if (alone != expected || walked != expected || wide != expected)
      return absl::StrCat("a ball finds ", alone, ", in a walk ", walked, ", by its bounds ", wide, " instead of ",
                          expected);
  }
  return "";
}

// Returns `object` moved to the position of another object, half of the time with one coordinate reduced by up to half.
// So queries of the scene find the moved object. Sometimes the object gets the complete shape of another object,
// including its position and rotation.
inline Object moved(const Object& object, const std::vector<Object>& objects, Random& random) {
  Object result = object;
  result.shape.position = random.pick(objects).shape.position;
  if (random.chance(0.5)) result.shape.position[static_cast<int>(random.below(3))] *= random.between(0.5, 1);
  if (random.chance(0.2)) result.shape = random.pick(objects).shape;
  return result;
}

// Applies random batches of inserts, moves and removes to a grid and a list in lockstep. Now and then keeps a snapshot
// of the grid and a copy of the list; the answers of each pair must still be equal at the end.
class GridLockstep {
 public:
  GridLockstep(const ObjectScene& scene, Random& random)
      : scene_(scene), random_(random), grid_(random_grid_options(random)) {}

  std::string run(int batches) {
    std::vector<std::pair<ObjectSet, ObjectList>> kept;
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
  template <class Grid>
  static std::string difference(const Grid& grid, const ObjectList& list, const ObjectScene& scene) {
    const std::string what = IndexJudge(grid, list).difference(scene);
    if (!what.empty()) return ": " + what;
    size_t present = 0;
    for (const Object& object : list.values()) present += grid.contains(object);
    return present == list.size() ? "" : ": an object is not where contains() looks";
  }
  template <class Grid>
  std::string difference(const Grid& grid, const ObjectList& list) const {
    return difference(grid, list, scene_);
  }

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
    for (const Object& object : removed) LOCUS_CHECK(grid_.remove(object));
    for (const Object& object : inserted) grid_.insert(object);
  }

  const Object* find(Id id) const {
    for (const Object& object : list_.values()) {
      if (object.id == id) return &object;
    }
    return nullptr;
  }

  const ObjectScene& scene_;
  Random& random_;
  ObjectGrid grid_;
  ObjectList list_;
};

// Applies a dozen random batches of the scene's objects to a grid and compares the grid with a list after each batch.
inline std::string moving_grid_difference(const ObjectScene& scene, Random& random) {
  ObjectScene shorter = scene;
  while (shorter.rays.size() > 12) shorter.rays.pop_back();
  return GridLockstep(shorter, random).run(12);
}

// Searches the scenes draw(seed, random) of the seeds 0 to count - 1. Returns the first difference that compare(scene,
// random) finds; empty if there is none.
template <class Draw, class Compare>
std::string search_grid_scenes(uint64_t count, const Draw& draw, const Compare& compare) {
  for (uint64_t seed = 0; seed < count; ++seed) {
    Random random(seed);
    const ObjectScene scene = make_scene<Object>(draw(seed, random), random);
    const std::string what = compare(scene, random);
    if (!what.empty()) return "seed " + std::to_string(seed) + ", " + what;
  }
  return "";
}

// Generates the scene of `seed`, alternately from the adversarial families and from the families for grids.
inline SceneSketch any_adversarial_scene(uint64_t seed, Random& random) {
  return seed % 2 == 0 ? adversarial_scene(seed / 2, random) : grid_scene(seed / 2, random);
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_GRID_COMPARISON_H_
