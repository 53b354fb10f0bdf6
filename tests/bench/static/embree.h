// Embree 3 as peers of the static suite: a device of one thread, scenes of MEDIUM quality, Embree's own choice of
// instruction set. Built only if Debian's libembree-dev is installed; see peers.h.
#ifndef LOCUS_TESTS_BENCH_STATIC_EMBREE_H_
#define LOCUS_TESTS_BENCH_STATIC_EMBREE_H_

#include "tests/bench/static/peer.h"

namespace locus::bench {

// Adds embree_intersect1, embree_intersect1m, embree_intersect8 and embree_intersect16 (first hits), embree_occluded1
// (any hits), embree_robust (first, any and all hits, with RTC_SCENE_FLAG_ROBUST), embree_point_query (balls, and boxes
// by the balls around them).
void add_embree_peers(const BenchMesh& mesh, Needs needs, Peers& peers);

// Makes the builder embree_medium, which commits a scene from buffers of vertices and indices. Its bytes are those that
// Embree's memory monitor reports, plus the buffers.
std::unique_ptr<Builder> embree_builder(const BenchMesh& mesh);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_EMBREE_H_
