// CGAL's AABB tree in float as a peer of the static suite: rays and boxes. CGAL is not used for balls: its balls are
// surfaces, so it would not find triangles inside a ball. Built only if libcgal-dev is installed; see peers.h.
#ifndef LOCUS_TESTS_BENCH_STATIC_CGAL_H_
#define LOCUS_TESTS_BENCH_STATIC_CGAL_H_

#include "tests/bench/static/peer.h"

namespace locus::bench {

void add_cgal_peer(const BenchMesh& mesh, Needs needs, Peers& peers);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_CGAL_H_
