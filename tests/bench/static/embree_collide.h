// Embree's rtcCollide as a peer for boxes: the boxes of a batch become a scene of their own, built anew for each batch,
// whose pairs with the triangles' boxes are decided one by one. Only where Debian's libembree-dev is; see peers.h.
#ifndef LOCUS_TESTS_BENCH_STATIC_EMBREE_COLLIDE_H_
#define LOCUS_TESTS_BENCH_STATIC_EMBREE_COLLIDE_H_

#include "tests/bench/static/peer.h"

namespace locus::bench {

void add_embree_collide_peer(const BenchMesh& mesh, Needs needs, Peers& peers);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_EMBREE_COLLIDE_H_
