// Embree's rtcCollide as a peer for boxes: for each batch of boxes a scene is built. rtcCollide finds pairs of a box
// and a triangle's box, and a float test decides about each pair. Built only if Debian's libembree-dev is installed;
// see peers.h.
#ifndef LOCUS_TESTS_BENCH_STATIC_EMBREE_COLLIDE_H_
#define LOCUS_TESTS_BENCH_STATIC_EMBREE_COLLIDE_H_

#include "tests/bench/static/peer.h"

namespace locus::bench {

void add_embree_collide_peer(const BenchMesh& mesh, Needs needs, Peers& peers);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_EMBREE_COLLIDE_H_
