// Embree's rtcCollide as a peer for boxes: the boxes of a batch become a scene of their own, built for each batch, and
// an exact test decides about each of its pairs with the triangles' boxes. Only if Debian's libembree-dev is installed;
// see peers.h.
#ifndef LOCUS_TESTS_BENCH_STATIC_EMBREE_COLLIDE_H_
#define LOCUS_TESTS_BENCH_STATIC_EMBREE_COLLIDE_H_

#include "tests/bench/static/peer.h"

namespace locus::bench {

void add_embree_collide_peer(const BenchMesh& mesh, Needs needs, Peers& peers);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_EMBREE_COLLIDE_H_
