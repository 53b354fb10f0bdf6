#include "tests/bench/static/peers.h"

#if LOCUS_BENCH_EMBREE
#include "tests/bench/static/embree.h"
#include "tests/bench/static/embree_collide.h"
#endif
#if LOCUS_BENCH_BULLET
#include "tests/bench/static/bullet.h"
#endif
#if LOCUS_BENCH_BOOST
#include "tests/bench/static/boost_rtree.h"
#endif
#if LOCUS_BENCH_CGAL
#include "tests/bench/static/cgal.h"
#endif

namespace locus::bench {

Peers all_peers([[maybe_unused]] const BenchMesh& mesh, [[maybe_unused]] Needs needs,
                [[maybe_unused]] std::vector<std::string>& notes) {
  Peers peers;
#if LOCUS_BENCH_EMBREE
  add_embree_peers(mesh, needs, peers);
  add_embree_collide_peer(mesh, needs, peers);
#endif
#if LOCUS_BENCH_BULLET
  add_bullet_peer(mesh, needs, peers, notes);
#endif
#if LOCUS_BENCH_BOOST
  add_boost_peer(mesh, needs, peers);
#endif
#if LOCUS_BENCH_CGAL
  add_cgal_peer(mesh, needs, peers);
#endif
  return peers;
}

std::vector<std::unique_ptr<Builder>> all_builders([[maybe_unused]] const BenchMesh& mesh) {
  std::vector<std::unique_ptr<Builder>> builders;
#if LOCUS_BENCH_EMBREE
  builders.push_back(embree_builder(mesh));
#endif
  return builders;
}

}  // namespace locus::bench
