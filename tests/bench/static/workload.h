// The queries of the static suite: determined by a mesh and a seed and drawn in a fixed order, so that the workload can
// be repeated in any server at any time. Pure functions.
//
// Random numbers are SplitMix64 from the seed; f = (next >> 40) * 2^-24, uniform over [0, 1). Everything is float.
#ifndef LOCUS_TESTS_BENCH_STATIC_WORKLOAD_H_
#define LOCUS_TESTS_BENCH_STATIC_WORKLOAD_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/geometry/ball.h"
#include "core/geometry/obb.h"
#include "tests/bench/static/bench_mesh.h"

namespace locus::bench {

struct RayQuery {
  Vec3f origin;
  float t_max = 0;  // inclusive
  Vec3f direction;  // unit length
};

inline constexpr float kEndless = 1e30f;

// Returns rays from random points of the bounds (three draws) in random directions (z = 1 - 2f, then the angle 2 pi f).
std::vector<RayQuery> random_rays(const BenchMesh& mesh, size_t count, uint64_t seed, float t_max);

// Returns a picture: the eye 0.75 diagonals from the centre towards (0.6, 0.45, 0.66), up (0, 1, 0), vertical field of
// view 50 degrees, pixel centres, in tiles of 4 x 4. Width and height are multiples of 4.
std::vector<RayQuery> camera_rays(const BenchMesh& mesh, int width, int height);

// Returns balls: even ones on the surface (triangle next % n, u = sqrt(f), w = f, weights 1 - u, u (1 - w), u w), odd
// ones anywhere in the bounds. `fraction` of the diagonal is the radius.
std::vector<Ballf> balls(const BenchMesh& mesh, size_t count, uint64_t seed, float fraction);

// Returns boxes with the centres of balls; half extents fraction * diagonal * (0.5 + f) from the seed ^ 0xB0B, x, y, z.
// Not rotated.
std::vector<Obbf> boxes(const BenchMesh& mesh, size_t count, uint64_t seed, float fraction);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_WORKLOAD_H_
