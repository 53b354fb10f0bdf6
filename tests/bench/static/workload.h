// The queries of the static suite: determined by a mesh and a seed and drawn in a fixed order, so that the workload can
// be repeated in any server at any time. Pure functions.
//
// Random numbers are SplitMix64 from the seed; f = (next >> 40) * 2^-24, uniform over [0, 1). All arithmetic is float,
// except that camera_rays() computes in double.
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

// Returns rays from random points of the bounds (three draws for x, y, z) in random directions (two draws: z = 1 - 2f,
// then the angle 2 pi f around z).
std::vector<RayQuery> random_rays(const BenchMesh& mesh, size_t count, uint64_t seed, float t_max);

// Returns the rays of a picture, through pixel centres, in tiles of 4 x 4 pixels. The eye is 0.75 diagonals from the
// mesh's centre in the direction (0.6, 0.45, 0.66), up is (0, 1, 0), the vertical field of view is 50 degrees. Width
// and height must be multiples of 4.
std::vector<RayQuery> camera_rays(const BenchMesh& mesh, int width, int height);

// Returns balls of radius `fraction` * diagonal. Balls with even index are centred on the surface (triangle number next
// % n of the n triangles, then u = sqrt(f), w = f; the corners' weights are 1 - u, u (1 - w), u w), those with odd
// index anywhere in the bounds.
std::vector<Ballf> balls(const BenchMesh& mesh, size_t count, uint64_t seed, float fraction);

// Returns axis-aligned boxes with the centres of balls(). Half extents along x, y, z are fraction * diagonal * (0.5 +
// f), drawn with the seed `seed` ^ 0xB0B.
std::vector<Obbf> boxes(const BenchMesh& mesh, size_t count, uint64_t seed, float fraction);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_WORKLOAD_H_
