#include "tests/bench/dynamic/peers.h"

#include "tests/bench/frame/missing_peer.h"

namespace locus::bench::dynamic {

std::vector<Maker> peer_makers() {
  return {
#ifdef LOCUS_BENCH_BULLET
      {"bullet", false, bullet},
#endif
#ifdef LOCUS_BENCH_BOOST
      {"boost_rtree", true, boost_rtree},
#endif
#ifdef LOCUS_BENCH_NANOFLANN
      {"nanoflann", true, nanoflann_tree},
#endif
      {"flat_hash_map", true, naive_grid}, {"sorted_rebuild", false, sorted_rebuild},
  };
}

std::vector<std::string> missing_peers() {
  std::vector<std::string> sentences;
#ifndef LOCUS_BENCH_BULLET
  sentences.push_back(missing_peer("libbullet-dev"));
#endif
#ifndef LOCUS_BENCH_BOOST
  sentences.push_back(missing_peer("libboost-dev"));
#endif
#ifndef LOCUS_BENCH_NANOFLANN
  sentences.push_back(missing_peer("libnanoflann-dev"));
#endif
  return sentences;
}

}  // namespace locus::bench::dynamic
