#include "tests/bench/dynamic/peers.h"

namespace locus::bench::dynamic {

std::vector<Maker> peer_makers() {
  return {
#if LOCUS_BENCH_BULLET
    {"bullet", false, bullet},
#endif
#if LOCUS_BENCH_BOOST
        {"boost_rtree", true, boost_rtree},
#endif
#if LOCUS_BENCH_NANOFLANN
        {"nanoflann", true, nanoflann_tree},
#endif
        {"flat_hash_map", true, naive_grid}, {"sorted_rebuild", false, sorted_rebuild},
  };
}

}  // namespace locus::bench::dynamic
