// Comparison of sweeps with the predicates of overlap queries at single moments, on random movers, triangles and
// shapes. Used by the tests of sweeps and by the tests of planted bugs in sweeps.
#ifndef LOCUS_TESTS_SUPPORT_SWEEP_TRIALS_H_
#define LOCUS_TESTS_SUPPORT_SWEEP_TRIALS_H_

#include <algorithm>
#include <string>
#include <type_traits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/geometry/capsule.h"
#include "core/geometry/round_sweep.h"
#include "core/geometry/sweep.h"
#include "core/geometry/triangle_overlap.h"
#include "tests/support/random.h"
#include "tests/support/random_shape.h"
#include "tests/support/triangle_reference.h"

namespace locus::test {

// Returns whether the mover at time t, grown by `by` on every side, shares a point with a triangle or shape.
template <class Primitive>
bool overlaps_at(const Mover& mover, double t, double by, const Primitive& primitive) {
  const Vec3d center = mover.start + mover.way * t;
  if (mover.kind != MoverKind::kBox)
    return mover.radius + by >= 0 && capsule_overlaps(Capsule{center, mover.half_axis, mover.radius + by}, primitive);
  const Vec3d half = mover.half + Vec3d{by, by, by};
  if (std::min({half.x, half.y, half.z}) < 0) return false;
  if constexpr (std::is_same_v<Primitive, Triangle>)
    return box_overlaps(Obbf{to_float(center), to_float(half), mover.rotation}, primitive);
  else
    return box_overlaps(Obbd{center, half, mover.rotation}, primitive);
}

// Generates a mover that starts near or far from `target` and passes near it, or rests.
inline Mover random_mover(Random& random, Vec3d target, double size) {
  constexpr MoverKind kKinds[] = {MoverKind::kBall, MoverKind::kCapsule, MoverKind::kBox};
  Mover mover;
  mover.kind = random.pick(kKinds);
  mover.start = target + random.vector(size * random.magnitude(-3, 3));
  mover.way = (target + random.vector(size) - mover.start) * random.between(0.2, 2);
  if (random.chance(0.1)) mover.way[static_cast<int>(random.below(3))] = 0;
  if (random.chance(0.02)) mover.way = {};
  const double scale = size * random.magnitude(-5, 1);
  if (mover.kind != MoverKind::kBox) mover.radius = scale * random.between(0.01, 1);
  if (mover.kind == MoverKind::kCapsule) mover.half_axis = random.vector(scale * random.between(0, 3));
  if (mover.kind != MoverKind::kBox) return mover;
  for (int axis = 0; axis < 3; ++axis) mover.half[axis] = scale * random.between(0.01, 1);
  if (random.chance(0.7)) mover.rotation = rotation_of(random.rotation());
  return mover;
}

// A mover, and a triangle or shape that the mover may touch. `epsilon` covers the rounding of the overlap predicates.
template <class Primitive>
struct SweepTrial {
  Primitive primitive;
  Mover mover;
  double epsilon;
};

inline double magnitude_of(const Mover& mover, Vec3d position, double size) {
  return max_component(abs(mover.start)) + max_component(abs(mover.way)) + max_component(abs(position)) + size +
         max_component(extent_of(mover));
}

inline SweepTrial<Triangle> triangle_trial(Random& random) {
  const Triangle triangle = random_triangle(random);
  const double size = size_of(triangle);
  const Mover mover = random_mover(random, to_double(triangle.a), size);
  // The overlap of a box and a triangle is tested in float.
  const double rounding = mover.kind == MoverKind::kBox ? 1e-5 : 1e-9;
  return {triangle, mover, magnitude_of(mover, to_double(triangle.a), size) * rounding};
}

inline SweepTrial<Shape> shape_trial(Random& random) {
  const Shape shape = random_shape(random, random.pick(kShapeKinds), random.magnitude(-2, 10));
  const double size = 0.01 + max_component(to_double(shape.size)) + shape.radius;
  const Mover mover = random_mover(random, shape.position, size);
  return {shape, mover, magnitude_of(mover, shape.position, size) * 1e-9};
}

inline Corners swept_form(const Triangle& triangle) { return corners_of(triangle); }
inline const Shape& swept_form(const Shape& shape) { return shape; }

// Returns a description of the first difference between a sweep and overlaps at single moments; empty if there is none.
// Before the first contact, the mover shrunk by epsilon must overlap nothing; at the contact, the mover grown by
// epsilon must overlap the primitive; and PASS must skip a primitive if and only if the mover touches it at the start.
template <class Primitive>
std::string sweep_fault(const SweepTrial<Primitive>& trial, Random& random) {
  const auto form = swept_form(trial.primitive);
  const std::optional<double> t = first_contact(trial.mover, form, AtStart::kHit);
  const double end = t.value_or(1);
  for (int sample = 0; sample < 24; ++sample) {
    const double before = end * (sample == 0 ? 0 : sample == 1 ? 1 - 1e-9 : random.between(0, 1));
    if (before == end && t) continue;
    if (overlaps_at(trial.mover, before, -trial.epsilon, trial.primitive))
      return "an overlap at " + std::to_string(before) + " is missed";
  }
  if (!t) return "";
  if (!(*t >= 0 && *t <= 1)) return "a contact at " + std::to_string(*t);
  if (!overlaps_at(trial.mover, *t, trial.epsilon, trial.primitive)) return "no overlap at " + std::to_string(*t);
  const bool passed = !first_contact(trial.mover, form, AtStart::kPass).has_value();
  return passed == (*t == 0) ? "" : "PASS differs";
}

// Returns the first error of random sweeps past triangles and shapes; empty if there is none.
inline std::string sweep_difference() {
  Random random(183);
  for (int i = 0; i < 4'000; ++i) {
    if (std::string fault = sweep_fault(triangle_trial(random), random); !fault.empty()) return fault;
    if (std::string fault = sweep_fault(shape_trial(random), random); !fault.empty()) return fault;
  }
  return "";
}

// Makes a ball or capsule, and a triangle with an edge that the mover's surface touches from outside while passing it,
// up to rounding.
inline std::pair<Mover, Corners> grazing_trial(Random& random) {
  const double scale = random.magnitude(-4, 20), size = scale * random.magnitude(-12, 2);
  Mover mover;
  mover.kind = random.chance(0.5) ? MoverKind::kBall : MoverKind::kCapsule;
  mover.start = random.vector(scale);
  mover.way = random.unit_vector() * (size * random.magnitude(0, 6));
  mover.radius = size;
  if (mover.kind == MoverKind::kCapsule) mover.half_axis = random.vector(2 * size);
  const Vec3d along = normalized(mover.way);
  Vec3d out = cross(along, random.unit_vector());
  while (squared_length(out) < 1e-3) out = cross(along, random.unit_vector());
  out = normalized(out);
  const Vec3d edge = along * random.between(-1, 1) + cross(along, out) * random.between(-1, 1);
  const Vec3d touched = mover.start + mover.way * random.unit() +
                        mover.half_axis * (dot(mover.half_axis, out) < 0 ? -1 : 1) + out * mover.radius;
  const double extent = size * random.magnitude(-2, 4);
  return {mover,
          {touched - edge * (extent * random.unit()), touched + edge * (extent * random.unit()),
           touched + out * (extent * random.between(0.1, 1)) + edge * random.between(-extent, extent)}};
}

// Returns the first grazing contact that RoundSweep finds although misses_along_path() excludes it; empty if there is
// none. Adds the number of contacts to `contacts`.
inline std::string grazing_difference(int trials, int* contacts = nullptr) {
  constexpr uint64_t kSeed = 184;
  Random random(kSeed);
  for (int i = 0; i < trials; ++i) {
    const auto [mover, corners] = grazing_trial(random);
    const Corners relative = {corners[0] - mover.start, corners[1] - mover.start, corners[2] - mover.start};
    const RoundSweep sweep =
        RoundSweep::to_triangle(mover.half_axis, mover.radius, relative[0], relative[1], relative[2], -mover.way);
    if (!sweep.first_contact(1)) continue;
    if (contacts != nullptr) ++*contacts;
    if (misses_along_path(mover, relative)) return absl::StrCat("seed ", kSeed, ": trial ", i, " is lost");
  }
  return "";
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_SWEEP_TRIALS_H_
