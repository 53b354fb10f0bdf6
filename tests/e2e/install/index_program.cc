// Program of a user of locus::index: builds a tree of monsters, a type of its own, and asks it.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <optional>
#include <vector>

#include "core/index/bvh/bvh.h"
#include "core/index/queries/nearest_values.h"

namespace game {

struct Monster {
  uint32_t number = 0;
  locus::Vec3d feet;
  double height = 0;
};

// A ray, with what the index needs of it.
class Shot {
 public:
  explicit Shot(const locus::Rayd& ray) : slabs_(ray, 0x1p-40) {}
  const locus::SlabRay<double>& slabs() const { return slabs_; }
  double to_scaled(double t) const { return t; }

 private:
  locus::SlabRay<double> slabs_;
};

}  // namespace game

// A monster is the box between its feet and its head, half a metre wide.
template <>
struct locus::PrimitiveTraits<game::Monster> {
  using Scalar = double;
  using RayQuery = game::Shot;
  using BallQuery = Balld;
  using BoxQuery = Obbd;

  static uint64_t id(const game::Monster& monster) { return monster.number; }
  static Vec3d position(const game::Monster& monster) { return monster.feet; }
  static Aabbd bounds(const game::Monster& monster) {
    const Vec3d& feet = monster.feet;
    return {{feet.x - 0.5, feet.y - 0.5, feet.z}, {feet.x + 0.5, feet.y + 0.5, feet.z + monster.height}};
  }
  static std::optional<double> ray(const game::Monster& monster, const game::Shot& shot) {
    const Interval<double> interval = shot.slabs().interval(bounds(monster));
    if (!(interval.near <= interval.far && interval.far >= 0)) return std::nullopt;
    return std::max(interval.near, 0.0);
  }
  static bool ball(const game::Monster& monster, const Balld& ball) { return reaches(ball, bounds(monster)); }
  static bool box(const game::Monster& monster, const Obbd& box) { return overlaps(bounds_of(box), bounds(monster)); }
  static double distance(const game::Monster& monster, const Vec3d& point) {
    return std::sqrt(squared_distance(point, bounds(monster)));
  }
};

namespace game {
namespace {

void ask(const locus::Bvh<Monster>& index) {
  Monster monster;
  double distance = 100;
  const Shot shot(locus::Rayd{{0, 0, 1}, {1, 0, 0}});
  if (locus::first_ray(index, shot, monster, distance))
    std::cout << "the shot hits monster " << monster.number << " at " << distance << "\n";
  std::vector<Monster> near;
  locus::ball_overlap(index, {{12, 3, 0}, 5}, near);
  std::sort(near.begin(), near.end(), [](const Monster& a, const Monster& b) { return a.number < b.number; });
  std::cout << "near the explosion:";
  for (const Monster& one : near) std::cout << " " << one.number;
  std::vector<locus::ValueAt<Monster>> nearest;
  locus::nearest_values(index, {20, 20, 0}, 1000, 1, nearest);
  std::cout << "\nnearest to the door: " << nearest.at(0).value.number << "\n";
}

}  // namespace
}  // namespace game

int main() {
  const std::vector<game::Monster> monsters = {{7, {10, 0, 0}, 2}, {8, {-10, 0, 0}, 2}, {9, {14, 6, 0}, 1}};
  const absl::StatusOr<locus::Bvh<game::Monster>> tree = locus::Bvh<game::Monster>::build(monsters);
  if (!tree.ok()) return std::cerr << tree.status() << "\n", 1;
  game::ask(*tree);
}
