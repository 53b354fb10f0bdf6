// Families of rays for testing kernels: each family is known to reveal one kind of error. The rays are generated from
// seeds.
#ifndef LOCUS_TESTS_SUPPORT_KERNEL_TRIALS_H_
#define LOCUS_TESTS_SUPPORT_KERNEL_TRIALS_H_

#include <array>
#include <string>
#include <vector>

#include "tests/support/kernel_judge.h"

namespace locus::test {

namespace internal {

inline Aabbf bounds_of_all(const std::vector<Triangle>& triangles) {
  Aabbf bounds;
  for (const Triangle& triangle : triangles) bounds = merge(bounds, bounds_of(triangle));
  return bounds;
}

inline std::vector<Triangle> scaled_and_moved(std::vector<Triangle> triangles, float scale, Vec3f by) {
  for (Triangle& triangle : triangles)
    for (Vec3f* vertex : {&triangle.a, &triangle.b, &triangle.c}) *vertex = *vertex * scale + by;
  return triangles;
}

inline Vec3d place_within(const Triangle& triangle, Random& random) {
  const double u = random.unit(), v = random.unit() * (1 - u);
  return to_double(triangle.a) * (1 - u - v) + to_double(triangle.b) * u + to_double(triangle.c) * v;
}

}  // namespace internal

// Generates random queries: half of them have a limit of about a fifth of the mesh's size, and about a third of them
// cull the front or the back of triangles.
inline std::vector<KernelQuestion> random_questions(const std::vector<Triangle>& mesh, size_t count, uint64_t seed) {
  Random random(seed);
  const Aabbf bounds = internal::bounds_of_all(mesh);
  const double size = double{max_component(bounds.extent())};
  std::vector<KernelQuestion> questions(count);
  for (KernelQuestion& question : questions) {
    for (int axis = 0; axis < 3; ++axis)
      question.origin[axis] = random.between(bounds.min[axis] - 0.1 * size, bounds.max[axis] + 0.1 * size);
    question.direction = random.unit_vector() * random.magnitude(-19, 19);
    if (random.chance(0.5))
      question.limit = static_cast<float>(0.2 * size / std::sqrt(squared_length(question.direction)));
    if (random.chance(0.3)) question.cull = random.chance(0.5) ? Cull::kBack : Cull::kFront;
  }
  return questions;
}

inline KernelTrial random_trial(std::string name, const std::vector<Triangle>& mesh, size_t count, uint64_t seed) {
  return KernelTrial(std::move(name), mesh, random_questions(mesh, count, seed));
}

inline std::vector<KernelTrial> ordinary_trials() {
  std::vector<KernelTrial> trials;
  trials.push_back(random_trial("sphere", bumpy_sphere(14, 0.1, 1), scaled_count(4'000), 1));
  trials.push_back(random_trial("city", box_city(6, 1), scaled_count(4'000), 1));
  trials.push_back(random_trial("house", box_city(1, 2), scaled_count(4'000), 1));
  for (const float scale : {0x1p-23f, 0x1p-20f, 1e-3f, 1e6f, 0x1p30f})
    trials.push_back(random_trial(absl::StrCat("sphere times ", scale),
                                  internal::scaled_and_moved(bumpy_sphere(10, 0.1, 1), scale, {}), scaled_count(2'000),
                                  2));
  return trials;
}

// Makes trials far from the origin, where most tests in float are too imprecise and are repeated in double.
inline std::vector<KernelTrial> far_trials() {
  std::vector<KernelTrial> trials;
  for (const float distance : {1e3f, 1e5f, 1e7f})
    trials.push_back(
        random_trial(absl::StrCat("sphere at ", distance),
                     internal::scaled_and_moved(bumpy_sphere(10, 0.1, 1), 1, {distance, -2 * distance, distance / 2}),
                     scaled_count(2'000), 3));
  return trials;
}

// Makes runs of rays in nearly equal directions, as cameras and sensors generate them: from one position, from
// positions close together, or side by side along an axis. Limits and culling differ within a run.
inline KernelTrial beam_trial(std::string name, const std::vector<Triangle>& mesh, uint64_t seed) {
  Random random(seed);
  const Aabbf bounds = internal::bounds_of_all(mesh);
  const double size = double{max_component(bounds.extent())};
  std::vector<KernelQuestion> questions;
  while (questions.size() < scaled_count(3'000)) {
    const Vec3d origin = to_double(bounds.min + bounds.max) * 0.5 + random.vector(0.7 * size);
    const Triangle& target = random.pick(mesh);
    const Vec3d ahead = random.chance(0.5) ? to_double(target.a) - origin : random.unit_vector() * size;
    const Vec3d along = random.chance(0.2) ? random.whole_vector(1) * size : ahead;
    const double width = random.chance(0.2) ? 0 : size * random.magnitude(-12, -6);
    const bool side_by_side = random.chance(0.3);
    if (squared_length(along) == 0) continue;
    for (int ray = 0; ray < 20; ++ray) {
      KernelQuestion question;
      question.origin = side_by_side ? origin + random.vector(width) : origin;
      question.direction = side_by_side ? along : along + random.vector(width);
      if (random.chance(0.2)) question.limit = static_cast<float>(random.unit());
      if (random.chance(0.3)) question.cull = random.chance(0.5) ? Cull::kBack : Cull::kFront;
      questions.push_back(question);
    }
  }
  return KernelTrial(std::move(name), mesh, questions);
}

// Makes fans of rays from one point, as wide as the pixels of a near camera or as narrow as rounding. The point may be
// a vertex of the mesh or lie on an edge, and rays may be aimed exactly at vertices. Some fans lie in a plane of two
// axes, with components of 0 or -0.
inline KernelTrial fan_trial(std::string name, const std::vector<Triangle>& mesh, uint64_t seed) {
  Random random(seed);
  const Aabbf bounds = internal::bounds_of_all(mesh);
  const double size = double{max_component(bounds.extent())};
  std::vector<KernelQuestion> questions;
  while (questions.size() < scaled_count(4'000)) {
    const Triangle& start = random.pick(mesh);
    const Triangle& target = random.pick(mesh);
    Vec3d origin = to_double(bounds.min + bounds.max) * 0.5 + random.vector(size);
    if (random.chance(0.2)) origin = to_double(start.a);
    if (random.chance(0.2)) origin = to_double(start.a) + (to_double(start.b) - to_double(start.a)) * random.unit();
    const Vec3d ahead = to_double(target.a) - origin;
    const double width = max_component(abs(ahead)) * random.magnitude(-30, -3);
    const bool at_vertices = random.chance(0.3);
    const int flat_axis = random.chance(0.2) ? random.whole(0, 2) : 3;
    for (int ray = 0; ray < 16; ++ray) {
      KernelQuestion question;
      question.origin = origin;
      question.direction = ahead + random.vector(width);
      if (at_vertices) question.direction = to_double(random.pick(std::array{target.a, target.b, target.c})) - origin;
      if (flat_axis < 3) question.direction[flat_axis] = seed % 2 == 0 ? 0.0 : -0.0;
      if (random.chance(0.1)) question.limit = static_cast<float>(random.between(0.5, 1.5));
      if (random.chance(0.2)) question.cull = random.chance(0.5) ? Cull::kBack : Cull::kFront;
      if (max_component(abs(question.direction)) >= size * 0x1p-10) questions.push_back(question);
    }
  }
  return KernelTrial(std::move(name), mesh, questions);
}

inline std::vector<KernelTrial> fan_trials() {
  std::vector<KernelTrial> trials;
  trials.push_back(fan_trial("fans at a sphere", bumpy_sphere(14, 0.1, 1), 20));
  trials.push_back(fan_trial("fans at a city", box_city(6, 1), 21));
  trials.push_back(fan_trial("fans at a house", box_city(1, 2), 22));
  for (const float scale : {0x1p-9f, 0x1p9f})
    trials.push_back(fan_trial(absl::StrCat("fans at a sphere times ", scale),
                               internal::scaled_and_moved(bumpy_sphere(10, 0.1, 1), scale, {}), 23));
  trials.push_back(fan_trial("fans at a far sphere",
                             internal::scaled_and_moved(bumpy_sphere(10, 0.1, 1), 1, {1e3f, -2e3f, 5e2f}), 24));
  return trials;
}

// Makes runs of rays that are nearly parallel to a triangle and close to it. A kernel leaves these rays undecided for
// that triangle, although they hit other triangles of the same block.
inline KernelTrial edge_on_beam_trial() {
  Random random(15);
  const std::vector<Triangle> city = box_city(6, 1);
  std::vector<KernelQuestion> questions;
  while (questions.size() < scaled_count(3'000)) {
    const Triangle& target = random.pick(city);
    const Vec3d a = to_double(target.a), along = internal::place_within(target, random) - a;
    const double off = random.magnitude(-36, -22);
    for (int ray = 0; ray < 8; ++ray) {
      KernelQuestion question;
      question.origin = a - along * random.between(0.5, 0.51) + random.vector(off);
      question.direction = along + random.vector(off);
      questions.push_back(question);
    }
  }
  return KernelTrial("beams edge-on", city, questions);
}

inline std::vector<KernelTrial> beam_trials() {
  std::vector<KernelTrial> trials;
  trials.push_back(beam_trial("beams at a sphere", bumpy_sphere(14, 0.1, 1), 10));
  trials.push_back(beam_trial("beams at a city", box_city(6, 1), 11));
  trials.push_back(beam_trial("beams at a house", box_city(1, 2), 12));
  for (const float scale : {0x1p-20f, 1e6f})
    trials.push_back(beam_trial(absl::StrCat("beams at a sphere times ", scale),
                                internal::scaled_and_moved(bumpy_sphere(10, 0.1, 1), scale, {}), 13));
  trials.push_back(beam_trial("beams at a far sphere",
                              internal::scaled_and_moved(bumpy_sphere(10, 0.1, 1), 1, {1e5f, -2e5f, 5e4f}), 14));
  trials.push_back(edge_on_beam_trial());
  return trials;
}

// Makes rays along axes and diagonals from points of the lattice on which the corners of the houses lie. Many triangles
// are edge-on to such a ray or equally near.
inline KernelTrial lattice_trial() {
  Random random(4);
  std::vector<KernelQuestion> questions;
  while (questions.size() < scaled_count(6'000)) {
    KernelQuestion question;
    question.origin =
        Vec3d{double(random.whole(-2, 100)), double(random.whole(-2, 100)), double(random.whole(-2, 44))} * 0.5;
    question.direction = random.whole_vector(1);
    if (question.direction == Vec3d{}) continue;
    questions.push_back(question);
  }
  return KernelTrial("lattice", box_city(5, 1), questions);
}

// Makes rays nearly along axes and diagonals: the direction's components are -1, 0 or 1 in float, but differ slightly
// from these numbers in double. The rays start so close to the surface that t depends on the axis chosen for the
// projection.
inline KernelTrial near_diagonal_trial() {
  const std::vector<Triangle> sphere = bumpy_sphere(14, 0.1, 1);
  Random random(9);
  std::vector<KernelQuestion> questions;
  while (questions.size() < scaled_count(4'000)) {
    KernelQuestion question;
    question.direction = random.whole_vector(1);
    if (question.direction == Vec3d{}) continue;
    for (int axis = 0; axis < 3; ++axis) question.direction[axis] *= 1 + random.between(-1, 1) * 0x1p-26;
    question.origin =
        internal::place_within(random.pick(sphere), random) - question.direction * random.magnitude(-40, -20);
    questions.push_back(question);
  }
  return KernelTrial("near diagonals", sphere, questions);
}

inline KernelTrial border_trial() {
  const std::vector<Triangle> sphere = bumpy_sphere(14, 0.1, 1);
  Random random(5);
  std::vector<KernelQuestion> questions(scaled_count(6'000));
  for (KernelQuestion& question : questions) {
    const Triangle& triangle = random.pick(sphere);
    const double along = random.chance(0.3) ? 0 : random.unit();
    question.origin = random.vector(0.3);
    question.direction = to_double(triangle.a) * (1 - along) + to_double(triangle.b) * along - question.origin;
  }
  return KernelTrial("corners and edges", sphere, questions);
}

inline KernelTrial surface_trial() {
  const std::vector<Triangle> sphere = bumpy_sphere(14, 0.1, 1);
  Random random(6);
  std::vector<KernelQuestion> questions(scaled_count(4'000));
  for (KernelQuestion& question : questions) {
    question.origin = internal::place_within(random.pick(sphere), random);
    question.direction = random.unit_vector();
  }
  return KernelTrial("from the surface", sphere, questions);
}

// Makes slivers, a tenth of them without area, and rays, a fifth of them parallel to the long edge of a sliver.
inline KernelTrial sliver_trial() {
  Random random(7);
  std::vector<Triangle> slivers;
  for (int i = 0; i < 300; ++i) {
    const Vec3f a = random.float_vector(1), along = random.float_vector(1);
    const Vec3f off = random.float_vector(random.magnitude(-40, -4));
    slivers.push_back({a, a + along, a + along * 0.5f + (random.chance(0.1) ? Vec3f{} : off)});
  }
  number_in_order(slivers);
  std::vector<KernelQuestion> questions(scaled_count(6'000));
  for (KernelQuestion& question : questions) {
    const Triangle& triangle = random.pick(slivers);
    question.origin = random.vector(2);
    question.direction = to_double(triangle.a) * 0.5 + to_double(triangle.b) * 0.5 - question.origin;
    if (random.chance(0.2)) question.direction = to_double(triangle.b) - to_double(triangle.a);
  }
  return KernelTrial("slivers", slivers, questions);
}

// Makes a mesh that contains each triangle five times, and rays. Every hit is then a tie of five triangles, of which
// the lowest triangle number must win.
inline KernelTrial copies_trial() {
  std::vector<Triangle> copies;
  for (int copy = 0; copy < 5; ++copy)
    for (const Triangle& triangle : bumpy_sphere(6, 0.1, 1)) copies.push_back(triangle);
  number_in_order(copies);
  Random random(8);
  random.shuffle(copies);
  return random_trial("copies", copies, scaled_count(1'000), 8);
}

inline std::vector<KernelTrial> all_kernel_trials() {
  std::vector<KernelTrial> trials = ordinary_trials();
  for (KernelTrial& trial : far_trials()) trials.push_back(std::move(trial));
  for (KernelTrial& trial : beam_trials()) trials.push_back(std::move(trial));
  for (KernelTrial& trial : fan_trials()) trials.push_back(std::move(trial));
  for (KernelTrial (*const make)() :
       {lattice_trial, near_diagonal_trial, border_trial, surface_trial, sliver_trial, copies_trial})
    trials.push_back(make());
  return trials;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_KERNEL_TRIALS_H_
