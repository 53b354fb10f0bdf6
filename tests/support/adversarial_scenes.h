// Families of scenes that are known to break spatial indexes, and a family of ordinary random scenes. Each function
// generates one scene at random; equal states of the random generator result in equal scenes.
#ifndef LOCUS_TESTS_SUPPORT_ADVERSARIAL_SCENES_H_
#define LOCUS_TESTS_SUPPORT_ADVERSARIAL_SCENES_H_

#include <array>
#include <cmath>

#include "tests/support/scene_sketch.h"

namespace locus::test {

// Returns a random one of the 26 directions along axes and diagonals.
inline Vec3d lattice_direction(Random& random) {
  Vec3d direction;
  while (direction == Vec3d{}) direction = random.whole_vector(1);
  return direction;
}

inline std::array<Vec3d, 26> lattice_directions() {
  std::array<Vec3d, 26> directions;
  size_t count = 0;
  for (int i = 0; i < 27; ++i) {
    if (i != 13) directions[count++] = {double(i % 3 - 1), double(i / 3 % 3 - 1), double(i / 9 - 1)};
  }
  return directions;
}

// Returns a random notable point of the placement's box: a corner, the middle of an edge or of a face, or the centre.
inline Vec3d notable_point(const Placement& placement, Random& random) {
  const Vec3d sides = random.whole_vector(1);
  const Vec3d local = {sides.x * placement.half.x, sides.y * placement.half.y, sides.z * placement.half.z};
  return placement.center + rotation_of(placement.rotation).to_world(local);
}

inline Vec3d notable_point(const SceneSketch& sketch, Random& random) {
  return notable_point(random.pick(sketch.placements), random);
}

inline Obbd random_box(Vec3d center, double size, Random& random) {
  Obbd box{center, random.positive_vector(size), {}};
  if (random.chance(0.1)) box.half[static_cast<int>(random.below(3))] = 0;
  if (random.chance(0.6)) box.rotation = rotation_of(random.rotation());
  return box;
}

// Adds `count` rays, balls and boxes near the placements. The balls and boxes have sizes up to `size`. Most rays are
// aimed at notable points, the other rays have random directions.
inline void add_queries(SceneSketch& sketch, int count, double size, Random& random) {
  for (int i = 0; i < count; ++i) {
    const Vec3d target = notable_point(sketch, random);
    const Vec3d origin = notable_point(sketch, random) + random.vector(random.chance(0.2) ? 0 : size);
    const Vec3d aimed = target - origin;
    const bool aim = random.chance(0.7) && aimed != Vec3d{};
    sketch.rays.push_back({origin, aim ? aimed : random.unit_vector()});
    sketch.balls.push_back({notable_point(sketch, random) + random.vector(size), random.between(0, size)});
    sketch.boxes.push_back(random_box(notable_point(sketch, random) + random.vector(size), size, random));
  }
}

inline SceneSketch random_scene(Random& random) {
  SceneSketch sketch{"random", {}, {}, {}, {}};
  const double size = random.magnitude(-3, 2);
  for (uint64_t i = random.below(48) + 1; i > 0; --i) {
    Placement placement{random.vector(4), random.positive_vector(size), {}};
    if (random.chance(0.5)) placement.rotation = random.rotation();
    sketch.placements.push_back(placement);
  }
  add_queries(sketch, 6, 2, random);
  return sketch;
}

// Generates walls on the planes of a lattice. Rays start at lattice points or half-way between them, one in each of the
// 26 directions and a few in other directions. Balls and boxes often just touch the walls. `step` is the spacing of the
// lattice, `corner` its origin.
inline SceneSketch lattice_scene(std::string family, double step, Vec3d corner, Random& random) {
  SceneSketch sketch{std::move(family), {}, {}, {}, {}};
  const auto point = [&](int parts) { return corner + random.whole_vector(2 * parts) * (step / parts); };
  for (int i = 0; i < 32; ++i) {
    const int axis = static_cast<int>(random.below(3));
    Placement wall{point(1), {step / 2, step / 2, step / 2}, {}};
    for (int other = 0; other < 3; ++other) {
      if (other != axis) wall.center[other] += step / 2;
    }
    if (random.chance(0.85)) wall.half[axis] = 0;
    sketch.placements.push_back(wall);
  }
  for (const Vec3d direction : lattice_directions()) sketch.rays.push_back({point(2), direction * step});
  for (int i = 0; i < 8; ++i) {
    sketch.rays.push_back({point(1), point(2) - point(1) + Vec3d{step / 8, 0, 0}});
    sketch.balls.push_back({point(2), step * static_cast<double>(random.below(5)) / 2});
    const Vec3d half = {double(random.below(4)), double(random.below(4)), double(random.below(4))};
    sketch.boxes.push_back({point(2), half * (step / 2), {}});
  }
  return sketch;
}

inline SceneSketch walls_on_a_lattice(Random& random) {
  constexpr double kSteps[] = {1, 0.5, 8, 0.1, 1.0 / 3};
  return lattice_scene("walls on a lattice", random.pick(kSteps), {}, random);
}

inline SceneSketch tiny_lattice(Random& random) { return lattice_scene("tiny lattice", 1e-3, {}, random); }

inline SceneSketch far_lattice(Random& random) {
  constexpr double kOffsets[] = {1e5, -1e6, 1048576, 1e7, -5e8};
  const double offset = random.pick(kOffsets);
  return lattice_scene("far lattice", random.chance(0.5) ? 1 : 64, {offset, -offset / 2, offset / 8}, random);
}

// Generates boxes, and rays through two notable points of a box: these rays graze or cross the box exactly at corners
// and edges, or run along edges. Also generates ordinary rays.
inline SceneSketch edges_and_corners(Random& random) {
  SceneSketch sketch{"edges and corners", {}, {}, {}, {}};
  for (int i = 0; i < 24; ++i) {
    Placement box{random.vector(4), random.positive_vector(1), {}};
    if (random.chance(0.3)) box.half[static_cast<int>(random.below(3))] = 0;
    if (random.chance(0.3)) box.rotation = random.rotation();
    sketch.placements.push_back(box);
  }
  for (int i = 0; i < 16; ++i) {
    const Placement& box = random.pick(sketch.placements);
    const Vec3d from = notable_point(box, random), to = notable_point(box, random);
    if (from == to) continue;
    const bool along = random.chance(0.5);
    sketch.rays.push_back({from - (to - from) * (along ? 2.0 : 0.0), to - from});
    sketch.balls.push_back({from, std::sqrt(squared_length(to - from))});
    sketch.boxes.push_back({from, abs(to - from), {}});
  }
  add_queries(sketch, 8, 1, random);
  return sketch;
}

// Generates rays that start exactly on surfaces, edges and corners, or inside solids.
inline SceneSketch on_and_inside_solids(Random& random) {
  SceneSketch sketch{"on and inside solids", {}, {}, {}, {}};
  for (int i = 0; i < 20; ++i) {
    sketch.placements.push_back({random.vector(2), random.positive_vector(2) + Vec3d{0.1, 0.1, 0.1}, {}});
  }
  for (int i = 0; i < 24; ++i) {
    const Vec3d direction = random.chance(0.5) ? lattice_direction(random) : random.unit_vector();
    sketch.rays.push_back({notable_point(sketch, random), direction});
  }
  add_queries(sketch, 4, 0.5, random);
  return sketch;
}

// Generates many copies of a few placements. The copies become values with different ids.
inline SceneSketch coincident(Random& random) {
  SceneSketch sketch{"coincident", {}, {}, {}, {}};
  for (uint64_t i = random.below(3) + 1; i > 0; --i) {
    Placement original{random.vector(2), random.positive_vector(1), {}};
    if (random.chance(0.6)) original.half[static_cast<int>(random.below(3))] = 0;
    sketch.placements.insert(sketch.placements.end(), 4 + random.below(20), original);
  }
  for (int i = 0; i < 12; ++i) {
    sketch.rays.push_back({notable_point(sketch, random) - lattice_direction(random), lattice_direction(random)});
  }
  add_queries(sketch, 6, 1, random);
  return sketch;
}

// Generates points, lines, and slivers millions of times longer than wide.
inline SceneSketch degenerate_and_slivers(Random& random) {
  SceneSketch sketch{"degenerate and slivers", {}, {}, {}, {}};
  for (int i = 0; i < 32; ++i) {
    Placement thin{random.vector(2), random.positive_vector(2), {}};
    for (int axis = 0; axis < 3; ++axis) {
      const uint64_t kind = random.below(4);
      if (kind < 2) thin.half[axis] *= kind == 0 ? 0 : 1e-7;
    }
    if (random.chance(0.5)) thin.rotation = random.rotation();
    sketch.placements.push_back(thin);
  }
  add_queries(sketch, 12, 0.2, random);
  for (int i = 0; i < 6; ++i) sketch.balls.push_back({notable_point(sketch, random), 0});
  for (int i = 0; i < 6; ++i) sketch.boxes.push_back({notable_point(sketch, random), {}, {}});
  return sketch;
}

// Generates placements of about a centimetre beside placements of about ten kilometres.
inline SceneSketch tiny_beside_huge(Random& random) {
  SceneSketch sketch{"1 cm beside 10 km", {}, {}, {}, {}};
  for (int i = 0; i < 32; ++i) {
    const double size = random.chance(0.4) ? 1e4 : 1e-2;
    const Vec3d center = random.chance(0.5) ? random.vector(1) : random.vector(1e4);
    sketch.placements.push_back({center, random.positive_vector(size), {}});
  }
  add_queries(sketch, 8, random.chance(0.5) ? 1e4 : 1e-2, random);
  return sketch;
}

inline SceneSketch all_in_one_cell(Random& random) {
  SceneSketch sketch{"all in one cell", {}, {}, {}, {}};
  const Vec3d corner = random.whole_vector(3);
  for (int i = 0; i < 40; ++i) {
    sketch.placements.push_back({corner + random.vector(1e-3), random.positive_vector(1e-4), {}});
  }
  add_queries(sketch, 8, 1e-3, random);
  return sketch;
}

// Generates an ordinary scene far from the origin, where neighbouring floats are far apart.
inline SceneSketch far_out(Random& random) {
  SceneSketch sketch = random_scene(random);
  sketch.family = "far out";
  const double scale = random.chance(0.5) ? 1 : 1e3;
  const Vec3d offset = random.vector(1) * std::pow(10, random.between(6, 8.9));
  for (Placement& placement : sketch.placements) {
    placement = {placement.center * scale + offset, placement.half * scale, placement.rotation};
  }
  for (Rayd& ray : sketch.rays) ray = {ray.origin * scale + offset, ray.direction};
  for (Balld& ball : sketch.balls) ball = {ball.center * scale + offset, ball.radius * scale};
  for (Obbd& box : sketch.boxes) box = {box.center * scale + offset, box.half * scale, box.rotation};
  return sketch;
}

inline SceneSketch long_and_short_directions(Random& random) {
  SceneSketch sketch = random.chance(0.5) ? random_scene(random) : walls_on_a_lattice(random);
  sketch.family = "long and short directions";
  for (Rayd& ray : sketch.rays) ray.direction = ray.direction * std::pow(10, random.between(-30, 30));
  return sketch;
}

// Generates placements at distances from the origin that double from one placement to the next, so that a split at the
// middle of the bounds leaves nearly all placements on one side.
inline SceneSketch doubling_distances(Random& random) {
  SceneSketch sketch{"doubling distances", {}, {}, {}, {}};
  const Vec3d direction = random.chance(0.5) ? lattice_direction(random) : random.unit_vector();
  for (int i = -20; i < 20; ++i) {
    const double distance = std::exp2(i);
    sketch.placements.push_back({direction * distance, random.positive_vector(distance / 4), {}});
  }
  for (int i = 0; i < 6; ++i) sketch.rays.push_back({random.vector(1e-6), direction});
  add_queries(sketch, 8, random.magnitude(-18, 18), random);
  return sketch;
}

using SceneFamily = SceneSketch (*)(Random&);

inline constexpr SceneFamily kAdversarialFamilies[] = {
    walls_on_a_lattice,     tiny_lattice,         far_lattice,
    edges_and_corners,      on_and_inside_solids, coincident,
    tiny_beside_huge,       all_in_one_cell,      far_out,
    degenerate_and_slivers, doubling_distances,   long_and_short_directions,
};

// Generates the scene of `seed`; successive seeds select the families in turn.
inline SceneSketch adversarial_scene(uint64_t seed, Random& random) {
  return kAdversarialFamilies[seed % std::size(kAdversarialFamilies)](random);
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_ADVERSARIAL_SCENES_H_
