// The peers of the dynamic suite: libraries and what one would write oneself, each in a file of its own. Those of
// libraries are there only where their packages were when this program was configured.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_PEERS_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_PEERS_H_

#include <memory>
#include <vector>

#include "tests/bench/dynamic/contender.h"

namespace locus::bench::dynamic {

// btDbvt alone, as Debian ships it: boxes with a margin, stretched along the velocity.
std::unique_ptr<Contender> bullet();
// Boost.Geometry's rtree<linear<16>> of points: a move is a removal and an insertion.
std::unique_ptr<Contender> boost_rtree();
// nanoflann's tree of points, rebuilt each tick.
std::unique_ptr<Contender> nanoflann_tree();
// A hash map of cells.
std::unique_ptr<Contender> naive_grid();
// All objects sorted by cell each tick.
std::unique_ptr<Contender> sorted_rebuild();

// All there are.
std::vector<Maker> peer_makers();

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_PEERS_H_
