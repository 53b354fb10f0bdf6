#include "tests/bench/static/peers.h"

#include "absl/strings/str_cat.h"
#ifdef LOCUS_BENCH_EMBREE
#include "tests/bench/static/embree.h"
#include "tests/bench/static/embree_collide.h"
#endif
#ifdef LOCUS_BENCH_BULLET
#include "tests/bench/static/bullet.h"
#endif
#ifdef LOCUS_BENCH_BOOST
#include "tests/bench/static/boost_rtree.h"
#endif
#ifdef LOCUS_BENCH_CGAL
#include "tests/bench/static/cgal.h"
#endif

namespace locus::bench {

Peers all_peers([[maybe_unused]] const BenchMesh& mesh, [[maybe_unused]] Needs needs,
                [[maybe_unused]] std::vector<std::string>& notes) {
  Peers peers;
#ifdef LOCUS_BENCH_EMBREE
  add_embree_peers(mesh, needs, peers);
  add_embree_collide_peer(mesh, needs, peers);
#endif
#ifdef LOCUS_BENCH_BULLET
  add_bullet_peer(mesh, needs, peers, notes);
#endif
#ifdef LOCUS_BENCH_BOOST
  add_boost_peer(mesh, needs, peers);
#endif
#ifdef LOCUS_BENCH_CGAL
  add_cgal_peer(mesh, needs, peers);
#endif
  return peers;
}

std::vector<std::unique_ptr<Builder>> all_builders([[maybe_unused]] const BenchMesh& mesh) {
  std::vector<std::unique_ptr<Builder>> builders;
#ifdef LOCUS_BENCH_EMBREE
  builders.push_back(embree_builder(mesh));
#endif
  return builders;
}

std::vector<std::string> missing_peers() {
  std::vector<std::string> packages;
#ifndef LOCUS_BENCH_EMBREE
  packages.emplace_back("libembree-dev");
#endif
#ifndef LOCUS_BENCH_BULLET
  packages.emplace_back("libbullet-dev");
#endif
#ifndef LOCUS_BENCH_BOOST
  packages.emplace_back("libboost-dev");
#endif
#ifndef LOCUS_BENCH_CGAL
  packages.emplace_back("libcgal-dev");
#endif
  std::vector<std::string> sentences;
  sentences.reserve(packages.size());
  for (const std::string& package : packages)
    sentences.push_back(
        absl::StrCat("a peer is missing: ", package,
                     " was not installed when this program was configured; run deploy/packages.sh bench"));
  return sentences;
}

}  // namespace locus::bench
