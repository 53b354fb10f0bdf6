// Cases of the suite `queries` that measure distances to one mesh. Queries of the nearest triangle are compared with
// Embree's rtcPointQuery. Rows of balls with the columns of contacts are compared with the same rows without these
// columns.
#ifndef LOCUS_TESTS_BENCH_QUERIES_NEAREST_CASES_H_
#define LOCUS_TESTS_BENCH_QUERIES_NEAREST_CASES_H_

#include <memory>

#include "absl/types/span.h"
#include "core/base/ids.h"
#include "tests/bench/frame/suite.h"
#include "tests/bench/static/bench_mesh.h"

namespace locus::bench::queries {

struct NearestTriangle {
  float distance = -1;
  uint32_t triangle = kNoTriangle;
};

// Another library that finds the triangles nearest to points, one by one.
class NearestPeer {
 public:
  virtual ~NearestPeer() = default;
  // Writes the nearest triangle of each point to `answers`.
  virtual void nearest(absl::Span<const Vec3f> points, NearestTriangle* answers) = 0;
};

// Returns a peer that uses Embree: rtcPointQuery with a callback that computes distances to triangles in float, as
// Embree's tutorial closest_point does. The mesh must outlive the peer.
std::unique_ptr<NearestPeer> embree_nearest(const BenchMesh& mesh);

void run_nearest_cases(const Options& options, const Progress& progress, const BenchMesh& mesh, Report& report);

}  // namespace locus::bench::queries

#endif  // LOCUS_TESTS_BENCH_QUERIES_NEAREST_CASES_H_
