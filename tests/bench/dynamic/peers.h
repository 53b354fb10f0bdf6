// The peers of the dynamic suite: libraries, and simple structures written for comparison, each in a file of its own.
// Peers from libraries exist only if their packages were installed when this program was configured.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_PEERS_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_PEERS_H_

#include <memory>
#include <vector>

#include "tests/bench/dynamic/contender.h"

namespace locus::bench::dynamic {

// Makes Bullet's dynamic tree of boxes, btDbvt, without the rest of Bullet: boxes have a margin and are stretched along
// the velocity.
std::unique_ptr<Contender> bullet();
// Makes Boost.Geometry's rtree<linear<16>> of points: a move is a removal and an insertion.
std::unique_ptr<Contender> boost_rtree();
// Makes nanoflann's tree of points, rebuilt each tick.
std::unique_ptr<Contender> nanoflann_tree();
// Makes a hash map of cells.
std::unique_ptr<Contender> naive_grid();
// Makes a list of all objects, which is sorted by cell anew at each tick.
std::unique_ptr<Contender> sorted_rebuild();

// Returns the factories of all available peers.
std::vector<Maker> peer_makers();

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_PEERS_H_
