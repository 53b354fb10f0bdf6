// Bullet's static mesh as a peer of the static suite: btBvhTriangleMeshShape with quantised boxes, as Debian ships it.
// Built only if libbullet-dev is installed; see peers.h.
#ifndef LOCUS_TESTS_BENCH_STATIC_BULLET_H_
#define LOCUS_TESTS_BENCH_STATIC_BULLET_H_

#include <string>
#include <vector>

#include "tests/bench/static/peer.h"

namespace locus::bench {

// Adds the peer. Bullet stores triangle numbers in 21 bits: for a mesh with more triangles, adds a note instead.
void add_bullet_peer(const BenchMesh& mesh, Needs needs, Peers& peers, std::vector<std::string>& notes);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_BULLET_H_
