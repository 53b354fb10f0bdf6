// Cases of the suite `queries` that measure a turning sensor: 128 beams at 1024 angles, all from one point, in a level
// with moving boxes. Compared with Embree, which traces the same rays through the level and instances of a box.
#ifndef LOCUS_TESTS_BENCH_QUERIES_LIDAR_CASES_H_
#define LOCUS_TESTS_BENCH_QUERIES_LIDAR_CASES_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/types/span.h"
#include "tests/bench/frame/suite.h"
#include "tests/bench/static/bench_mesh.h"
#include "tests/bench/static/workload.h"

namespace locus::bench::queries {

// Box parallel to the axes.
struct LidarBox {
  Vec3f center, half;
};

// First hit of a ray; t is infinite if the ray hits nothing.
struct LidarHit {
  float t = 0;
  bool on_box = false;
};

// Another library that traces rays through the level and the boxes.
class LidarPeer {
 public:
  virtual ~LidarPeer() = default;
  virtual const char* name() const = 0;
  // Finds the first hits of rays with the same origin, whose number is a multiple of 16.
  virtual void first(absl::Span<const RayQuery> rays, LidarHit* hits) = 0;
};

// Returns peers that use Embree: rtcIntersect1, packets of 8 and 16 rays, and streams of 1024 rays, with flags for
// coherent rays. The level is one geometry, and each box is an instance of a scene of twelve triangles. The mesh must
// outlive the peers.
std::vector<std::unique_ptr<LidarPeer>> embree_lidars(const BenchMesh& mesh, const std::vector<LidarBox>& boxes);

void run_lidar_cases(const Options& options, const Progress& progress, const BenchMesh& mesh, Report& report);

}  // namespace locus::bench::queries

#endif  // LOCUS_TESTS_BENCH_QUERIES_LIDAR_CASES_H_
