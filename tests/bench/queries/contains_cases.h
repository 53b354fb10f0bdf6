// Cases of the suite `queries` that decide whether points are inside one closed mesh, compared with CGAL's
// Side_of_triangle_mesh.
#ifndef LOCUS_TESTS_BENCH_QUERIES_CONTAINS_CASES_H_
#define LOCUS_TESTS_BENCH_QUERIES_CONTAINS_CASES_H_

#include <cstdint>
#include <memory>

#include "absl/types/span.h"
#include "tests/bench/frame/suite.h"
#include "tests/bench/static/bench_mesh.h"

namespace locus::bench::queries {

// Another library that decides for points, one by one, whether a closed mesh contains them.
class ContainsPeer {
 public:
  virtual ~ContainsPeer() = default;
  // Writes one answer for each point (3 numbers): 1 if the point is inside the mesh or on its surface, else 0.
  virtual void contains(absl::Span<const float> points, uint8_t* answers) = 0;
};

// Returns a peer that uses CGAL; null if the mesh is not a closed manifold, which CGAL requires. The mesh need not
// outlive the peer.
std::unique_ptr<ContainsPeer> cgal_side(const BenchMesh& mesh);

// Runs the cases if the mesh is closed; otherwise adds a note.
void run_contains_cases(const Options& options, const Progress& progress, const BenchMesh& mesh, Report& report);

}  // namespace locus::bench::queries

#endif  // LOCUS_TESTS_BENCH_QUERIES_CONTAINS_CASES_H_
