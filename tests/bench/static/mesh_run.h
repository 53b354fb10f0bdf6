// Data that the cases of one mesh share, all borrowed. One thread.
#ifndef LOCUS_TESTS_BENCH_STATIC_MESH_RUN_H_
#define LOCUS_TESTS_BENCH_STATIC_MESH_RUN_H_

#include <algorithm>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "tests/bench/frame/cell.h"
#include "tests/bench/frame/suite.h"
#include "tests/bench/static/peer.h"

namespace locus::bench {

struct MeshRun {
  const Options& options;
  const Progress& progress;
  const BenchMesh& mesh;
  Peer& ours;
  const Peers& peers;
  Report& report;
};

inline std::string case_of(const std::string& start, const BenchMesh& mesh) {
  return absl::StrCat(start, "/", mesh.name);
}

// Queries that a contestant gets, and the index of each of them among all queries of the case.
template <class Query>
struct Asked {
  std::vector<Query> queries;
  std::vector<size_t> places;
};

// Returns the queries for a peer: all of them, or 16 of each 128 if the peer is slow.
template <class Query>
Asked<Query> asked_of(const Peer& peer, const std::vector<Query>& queries) {
  Asked<Query> asked;
  for (size_t i = 0; i < queries.size(); ++i) {
    if (peer.slow() && (i / 16) % 8 != 3) continue;
    asked.queries.push_back(queries[i]);
    asked.places.push_back(i);
  }
  return asked;
}

// Returns the index of the first query of a chunk, if `count` queries are divided into `chunks` chunks; `count` for
// chunk `chunks`.
inline size_t chunk_begin(size_t count, size_t chunk, size_t chunks) { return count * chunk / chunks; }

inline size_t chunks_for(size_t count, size_t chunk_size) {
  return std::max<size_t>(1, (count + chunk_size / 2) / chunk_size);
}

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_MESH_RUN_H_
