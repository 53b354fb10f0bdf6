// The queries of the static suite: fixed by a mesh and a seed, drawn in a fixed order, so that they can be asked of any
// server, any time. Pure functions.
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
  float t_max = 0;  // included
  Vec3f direction;  // of length one
};

inline constexpr float kEndless = 1e30f;

// From anywhere in the bounds (three draws) in any direction (z = 1 - 2f, then the angle 2 pi f).
std::vector<RayQuery> random_rays(const BenchMesh& mesh, size_t count, uint64_t seed, float t_max);

// A picture: the eye 0.75 diagonals from the centre towards (0.6, 0.45, 0.66), up (0, 1, 0), vertical field of view 50
// degrees, pixel centres, in tiles of 4 x 4. Width and height are multiples of 4.
std::vector<RayQuery> camera_rays(const BenchMesh& mesh, int width, int height);

// Even ones on the surface (triangle next % n, u = sqrt(f), w = f, weights 1 - u, u (1 - w), u w), odd ones anywhere in
// the bounds. `fraction` of the diagonal is the radius.
std::vector<Ballf> balls(const BenchMesh& mesh, size_t count, uint64_t seed, float fraction);

// Centres as those of balls; half extents fraction * diagonal * (0.5 + f) from the seed ^ 0xB0B, x, y, z. Not turned.
std::vector<Obbf> boxes(const BenchMesh& mesh, size_t count, uint64_t seed, float fraction);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_WORKLOAD_H_
