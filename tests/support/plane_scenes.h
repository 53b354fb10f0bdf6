// Families of scenes built to break structures that divide space by planes, in addition to the families of
// adversarial_scenes.h and grid_scenes.h.
#ifndef LOCUS_TESTS_SUPPORT_PLANE_SCENES_H_
#define LOCUS_TESTS_SUPPORT_PLANE_SCENES_H_

#include <cmath>

#include "tests/support/grid_scenes.h"

namespace locus::test {

// Generates values whose sides, and queries whose sides, lie on the planes at which a cube is halved again and again.
inline SceneSketch all_on_dividing_planes(Random& random) {
  SceneSketch sketch{"all on dividing planes", {}, {}, {}, {}};
  const auto on_plane = [&random] {
    const double step = std::exp2(-random.whole(0, 3));
    return random.whole_vector(static_cast<int>(4 / step)) * step;
  };
  sketch.placements.push_back({{-4, -4, -4}, {}, {}});
  sketch.placements.push_back({{4, 4, 4}, {}, {}});
  for (int i = 0; i < 40; ++i) {
    Placement placement{on_plane(), {}, {}};
    for (int axis = 0; axis < 3; ++axis) placement.half[axis] = random.chance(0.4) ? 0 : random.whole(1, 2) * 0.25;
    sketch.placements.push_back(placement);
  }
  for (int i = 0; i < 16; ++i) {
    sketch.balls.push_back({on_plane(), random.whole(0, 8) * 0.125});
    const Vec3d half = random.whole_vector(4);
    sketch.boxes.push_back({on_plane(), abs(half) * 0.25, {}});
  }
  add_lattice_rays(sketch, 0.5, random);
  return sketch;
}

// Generates pairs of points and small boxes whose coordinates differ by the least step of float or of double.
inline SceneSketch one_step_apart(Random& random) {
  SceneSketch sketch{"one step apart", {}, {}, {}, {}};
  for (int i = 0; i < 20; ++i) {
    const Vec3d first = to_double(random.float_vector(random.magnitude(-3, 10)));
    Vec3d second = first;
    for (int axis = 0; axis < 3; ++axis) {
      if (random.chance(0.4)) continue;
      const float next = std::nextafter(static_cast<float>(first[axis]), random.chance(0.5) ? 1e9f : -1e9f);
      second[axis] = random.chance(0.5) ? double{next} : std::nextafter(first[axis], double{next});
    }
    const Vec3d half = random.chance(0.5) ? Vec3d{} : random.positive_vector(0x1p-20);
    sketch.placements.push_back({first, half, {}});
    sketch.placements.push_back({second, half, {}});
    sketch.balls.push_back({first, random.chance(0.5) ? 0 : std::sqrt(squared_length(second - first))});
    sketch.boxes.push_back({second, {}, {}});
    sketch.rays.push_back({first - lattice_direction(random), lattice_direction(random)});
    if (first != second) sketch.rays.push_back({first, second - first});
  }
  add_queries(sketch, 4, 1, random);
  return sketch;
}

// Generates long slanted bars and small values between them, so that a ray meets a bar in one part of space, but hits
// it only in a later part, behind other values (Hughes et al., ch. 37, Fig. 37.15).
inline SceneSketch bars_through_many_parts(Random& random) {
  SceneSketch sketch{"bars through many parts", {}, {}, {}, {}};
  for (int i = 0; i < 48; ++i) {
    if (i % 4 != 0) {
      sketch.placements.push_back({random.vector(8), random.positive_vector(0.2) + Vec3d{0.01, 0.01, 0.01}, {}});
      continue;
    }
    Placement bar{random.vector(3), {0.05, 0.05, 0.05}, random.rotation()};
    bar.half[static_cast<int>(random.below(3))] = 8;
    sketch.placements.push_back(bar);
  }
  add_queries(sketch, 16, 2, random);
  add_lattice_rays(sketch, 4, random);
  return sketch;
}

// Generates a few values near the origin, then values up to a million times as far away. An index that is built of the
// first ones gets the others as inserts outside its first bounds.
inline SceneSketch far_outside_the_first(Random& random) {
  SceneSketch sketch{"far outside the first", {}, {}, {}, {}};
  for (int i = 0; i < 36; ++i) {
    const double away = i < 18 ? 1 : random.magnitude(1, 20);
    sketch.placements.push_back({random.vector(away), random.positive_vector(away / 8), random.rotation()});
  }
  add_queries(sketch, 12, random.magnitude(0, 18), random);
  add_lattice_rays(sketch, random.magnitude(0, 18), random);
  return sketch;
}

inline constexpr SceneFamily kPlaneFamilies[] = {all_on_dividing_planes, one_step_apart, bars_through_many_parts,
                                                 far_outside_the_first};

// Generates the scene of `seed` in turn from the adversarial families, the families for grids and those of this file.
inline SceneSketch structure_scene(uint64_t seed, Random& random) {
  if (seed % 3 == 0) return adversarial_scene(seed / 3, random);
  if (seed % 3 == 1) return grid_scene(seed / 3, random);
  return kPlaneFamilies[seed / 3 % std::size(kPlaneFamilies)](random);
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_PLANE_SCENES_H_
