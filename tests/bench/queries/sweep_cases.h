// Cases of the suite `queries` in which solids move through one mesh. A sweep finds the first contact of its solid
// (FIRST) and ignores triangles that the solid touches at its start (PASS). The cases are compared with Bullet's
// convexSweepTest, which ignores such triangles too.
#ifndef LOCUS_TESTS_BENCH_QUERIES_SWEEP_CASES_H_
#define LOCUS_TESTS_BENCH_QUERIES_SWEEP_CASES_H_

#include <functional>
#include <memory>
#include <vector>

#include "absl/types/span.h"
#include "core/geometry/mover.h"
#include "tests/bench/frame/suite.h"
#include "tests/bench/static/bench_mesh.h"

namespace locus::bench::queries {

// Sweeps of one case: all move the same solid, which is not rotated and has dimensions that are exact floats.
struct SweepWork {
  Mover solid;
  std::vector<float> starts;  // 3 per sweep
  std::vector<float> ends;

  size_t size() const { return starts.size() / 3; }
};

// Result of one sweep; t is 2 for a miss.
struct SweepHit {
  float t = 2;
  Vec3f normal;
};

// Another library that answers the sweeps of a mesh, one by one.
class SweepPeer {
 public:
  virtual ~SweepPeer() = default;
  // Answers sweeps [begin, end) of `work`.
  virtual void sweep(const SweepWork& work, size_t begin, size_t end, SweepHit* hits) = 0;
};

// Returns a peer that uses Bullet. The mesh need not outlive the peer.
std::unique_ptr<SweepPeer> bullet_sweeps(const BenchMesh& mesh);

void run_sweep_cases(const Options& options, const Progress& progress, const BenchMesh& mesh, Report& report);

}  // namespace locus::bench::queries

#endif  // LOCUS_TESTS_BENCH_QUERIES_SWEEP_CASES_H_
