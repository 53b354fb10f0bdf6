// All peers of the static suite that this build has: CMake selects those whose libraries are installed.
// `deploy/packages.sh bench` installs all.
#ifndef LOCUS_TESTS_BENCH_STATIC_PEERS_H_
#define LOCUS_TESTS_BENCH_STATIC_PEERS_H_

#include <string>
#include <vector>

#include "tests/bench/static/peer.h"

namespace locus::bench {

// Makes the peers for a mesh. Adds a note for each peer that cannot store this mesh.
Peers all_peers(const BenchMesh& mesh, Needs needs, std::vector<std::string>& notes);

// Makes the builders of the cases build and memory.
std::vector<std::unique_ptr<Builder>> all_builders(const BenchMesh& mesh);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_PEERS_H_
