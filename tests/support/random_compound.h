// Random compounds for tests: a few parts or as many as are allowed, ordinary or difficult.
#ifndef LOCUS_TESTS_SUPPORT_RANDOM_COMPOUND_H_
#define LOCUS_TESTS_SUPPORT_RANDOM_COMPOUND_H_

#include <algorithm>
#include <utility>
#include <vector>

#include "core/base/limits.h"
#include "core/geometry/compound.h"
#include "tests/support/random.h"

namespace locus::test {

// Generates a part within about `size` of its object: sometimes at the centre, on a lattice, far away, without extent,
// or with a rotation that is almost none.
inline Part random_part(Random& random, double size) {
  constexpr ShapeKind kKinds[] = {ShapeKind::kBall, ShapeKind::kBox, ShapeKind::kCapsule};
  constexpr Layers kLayers[] = {kAllLayers, kAllLayers, 1, 2, 3, 0, 0x80000001u};
  Part part;
  part.kind = random.pick(kKinds);
  part.layers = random.pick(kLayers);
  if (random.chance(0.5)) part.position = to_float(random.vector(size));
  if (random.chance(0.3)) part.position = to_float(random.whole_vector(3) * size);
  if (random.chance(0.05)) part.position = to_float(random.vector(size * 1000));
  if (random.chance(0.5)) part.rotation = random.rotation();
  if (random.chance(0.1)) part.rotation = normalized(Quaternion{1e-4f, 0, -1e-5f, 1});
  const double scale = size * random.magnitude(-5, 1);
  if (random.chance(0.85)) part.radius = static_cast<float>(scale);
  for (int axis = 0; axis < 3; ++axis)
    if (random.chance(0.85)) part.size[axis] = static_cast<float>(scale * random.magnitude(-3, 0));
  return part;
}

inline CompoundPtr random_compound(Random& random, double size) {
  const uint64_t count = random.chance(0.1) ? limits::kMaxParts : 1 + random.below(6);
  std::vector<Part> parts;
  for (uint64_t i = 0; i < count; ++i) {
    parts.push_back(random_part(random, size));
    if (i > 0 && random.chance(0.1)) parts.back() = parts[i - 1];  // equal parts, so that all their hits tie
  }
  return Compound::make(std::move(parts));
}

// Generates a compound about as large as `shape`, which usually is one of its parts.
inline CompoundPtr compound_around(Random& random, const Shape& shape) {
  // Parts lie within 1000 times this size, and their values must be at most 1e9.
  const double size = random.chance(0.7) ? std::min(extent_of(shape) + 0.5, 1e5) : 2;
  std::vector<Part> parts = random_compound(random, size)->parts();
  if (random.chance(0.8))
    parts[random.below(parts.size())] = {shape.kind, {}, {}, shape.size, shape.radius, kAllLayers};
  return Compound::make(std::move(parts));
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_RANDOM_COMPOUND_H_
