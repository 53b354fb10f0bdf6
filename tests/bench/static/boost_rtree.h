// Boost.Geometry's R-tree as a peer of the static suite: it stores the boxes of triangles in packed nodes of 16. Built
// only if libboost-dev is installed; see peers.h.
#ifndef LOCUS_TESTS_BENCH_STATIC_BOOST_RTREE_H_
#define LOCUS_TESTS_BENCH_STATIC_BOOST_RTREE_H_

#include "tests/bench/static/peer.h"

namespace locus::bench {

void add_boost_peer(const BenchMesh& mesh, Needs needs, Peers& peers);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_BOOST_RTREE_H_
