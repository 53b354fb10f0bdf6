// The queries of the static suite. A mesh and a seed determine the queries, which are drawn in a fixed order, so that
// the workload can be repeated in any server at any time. Pure functions.
//
// In the comments below, `next` is the next 64-bit number of a SplitMix64 generator with the given seed, and
// f = (next >> 40) * 2^-24 is uniform over [0, 1). Each `next` and each f is a new draw. All arithmetic is float,
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

// Returns balls of radius `fraction` * diagonal. The centre of a ball with odd index is anywhere in the bounds (three
// draws for x, y, z). The centre of a ball with even index is on the surface: in the triangle with index next % n,
// where n is the number of triangles. Then u = sqrt(f) and w = f are drawn; the weights of the triangle's corners are
// 1 - u, u (1 - w) and u w.
std::vector<Ballf> balls(const BenchMesh& mesh, size_t count, uint64_t seed, float fraction);

// Returns axis-aligned boxes with the centres of balls(). The half extent along each axis is
// `fraction` * diagonal * (0.5 + f). A generator with the seed `seed` ^ 0xB0B draws f for x, y, z of each box in turn.
std::vector<Obbf> boxes(const BenchMesh& mesh, size_t count, uint64_t seed, float fraction);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_WORKLOAD_H_
