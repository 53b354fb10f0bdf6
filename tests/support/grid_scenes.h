// Families of scenes built to break grids, in addition to the families of adversarial_scenes.h: placements on cell
// borders of several levels, on both sides of zero, at the world's edge, larger than all cells, or of uneven density.
#ifndef LOCUS_TESTS_SUPPORT_GRID_SCENES_H_
#define LOCUS_TESTS_SUPPORT_GRID_SCENES_H_

#include "core/base/limits.h"
#include "tests/support/adversarial_scenes.h"

namespace locus::test {

// Adds a ray in each of the 26 directions along axes and diagonals. Each ray passes through a notable point of
// `sketch`: the ray's origin is this point minus k * `step` * direction, for a random whole number k from 0 to 3.
inline void add_lattice_rays(SceneSketch& sketch, double step, Random& random) {
  for (const Vec3d direction : lattice_directions()) {
    sketch.rays.push_back({notable_point(sketch, random) - direction * (step * random.whole(0, 3)), direction});
  }
}

// Generates small placements and one to three placements that are usually larger than the region of the small ones.
inline SceneSketch giants_among_small(Random& random) {
  SceneSketch sketch{"giants among small ones", {}, {}, {}, {}};
  for (int i = 0; i < 40; ++i) {
    const double size = i < random.whole(1, 3) ? random.magnitude(10, 29) : 0.5;
    sketch.placements.push_back({random.vector(100), random.positive_vector(size), random.rotation()});
  }
  add_queries(sketch, 8, 20, random);
  add_lattice_rays(sketch, 8, random);
  return sketch;
}

// Generates points, and shapes without extent, exactly on borders of cells of several sizes.
inline SceneSketch points_on_borders(Random& random) {
  SceneSketch sketch{"points on borders", {}, {}, {}, {}};
  const double step = std::exp2(random.whole(-3, 6));
  for (int i = 0; i < 40; ++i) sketch.placements.push_back({random.whole_vector(5) * step, {}, {}});
  for (int i = 0; i < 16; ++i) {
    const Vec3d center = random.whole_vector(5) * step;
    sketch.balls.push_back({center, step * random.whole(0, 3)});
    const Vec3d half = random.whole_vector(3);
    sketch.boxes.push_back({center, abs(half) * step, {}});
  }
  add_lattice_rays(sketch, step, random);
  return sketch;
}

// Generates cubes whose side is the cell size of a level, either exactly or multiplied by 1 + 2^-22. Their centres are
// on cell borders of that level.
inline SceneSketch sizes_between_levels(Random& random) {
  SceneSketch sketch{"sizes between levels", {}, {}, {}, {}};
  for (int i = 0; i < 40; ++i) {
    const double edge = std::exp2(random.whole(-4, 8));
    const double half = edge / 2 * (random.chance(0.5) ? 1 : 1 + 0x1p-22);
    sketch.placements.push_back({random.whole_vector(4) * edge, {half, half, half}, {}});
  }
  add_queries(sketch, 6, random.magnitude(-4, 8), random);
  add_lattice_rays(sketch, random.magnitude(-4, 8), random);
  return sketch;
}

// Generates placements just below and just above zero, whose cell indices would be equal if they were truncated towards
// zero.
inline SceneSketch around_zero(Random& random) {
  SceneSketch sketch{"around zero", {}, {}, {}, {}};
  const double size = random.magnitude(-10, 3);
  for (int i = 0; i < 40; ++i) {
    const Vec3d half = random.chance(0.5) ? Vec3d{} : random.positive_vector(size / 20);
    sketch.placements.push_back({random.vector(size), half, {}});
  }
  for (int i = 0; i < 24; ++i) {
    const Vec3d at = random.vector(size);
    sketch.rays.push_back({at * 3, at * -1});
    sketch.balls.push_back({at, size / 10});
    sketch.boxes.push_back({at, random.positive_vector(size / 5), {}});
  }
  return sketch;
}

// Generates placements at the corners, edges and faces of the world, with rays across the world.
inline SceneSketch world_edges(Random& random) {
  constexpr double kEdge = limits::kMaxCoordinate;
  SceneSketch sketch{"world edges", {}, {}, {}, {}};
  for (int i = 0; i < 40; ++i) {
    const Vec3d corner = random.whole_vector(1) * kEdge;
    const Vec3d inward = random.positive_vector(random.chance(0.5) ? 10 : 1e4);
    Vec3d center = corner;
    for (int axis = 0; axis < 3; ++axis) center[axis] -= std::copysign(inward[axis], corner[axis]);
    sketch.placements.push_back({center, random.positive_vector(random.chance(0.8) ? 5 : 1e6), {}});
  }
  add_queries(sketch, 12, random.chance(0.5) ? 10 : 1e9, random);
  add_lattice_rays(sketch, 1e8, random);
  return sketch;
}

// Generates one or two crowds of small placements in a world that is much wider than they are, with lone placements
// around them, some of which are as wide as a crowd.
inline SceneSketch hubs_in_open_country(Random& random) {
  SceneSketch sketch{"hubs in open country", {}, {}, {}, {}};
  const double hub = random.magnitude(-4, 4), country = hub * random.magnitude(2, 12);
  const Vec3d hubs[] = {random.vector(country), random.vector(country / 2)};
  for (int i = 0; i < 60; ++i) {
    const bool lone = i % 3 == 0;
    const Vec3d center = lone ? random.vector(country) : hubs[random.below(2)] + random.vector(hub);
    const double size = random.chance(0.1) ? hub : hub / 100;
    sketch.placements.push_back({center, random.positive_vector(size), random.rotation()});
  }
  add_queries(sketch, 8, random.chance(0.5) ? hub : country, random);
  add_lattice_rays(sketch, country / 8, random);
  return sketch;
}

inline constexpr SceneFamily kGridFamilies[] = {giants_among_small, points_on_borders, sizes_between_levels,
                                                around_zero,        world_edges,       hubs_in_open_country};

inline SceneSketch grid_scene(uint64_t seed, Random& random) {
  return kGridFamilies[seed % std::size(kGridFamilies)](random);
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_GRID_SCENES_H_
