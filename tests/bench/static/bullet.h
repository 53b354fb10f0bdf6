// Bullet's static mesh as a peer of the static suite: btBvhTriangleMeshShape with quantised boxes, as Debian ships it.
// Only where libbullet-dev is; see peers.h.
#ifndef LOCUS_TESTS_BENCH_STATIC_BULLET_H_
#define LOCUS_TESTS_BENCH_STATIC_BULLET_H_

#include "tests/bench/static/peer.h"

namespace locus::bench {

void add_bullet_peer(const BenchMesh& mesh, Needs needs, Peers& peers);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_BULLET_H_
