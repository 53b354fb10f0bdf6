#include "tests/bench/dynamic/world_run.h"

#include "tests/bench/dynamic/peers.h"

namespace locus::bench::dynamic {

std::vector<Maker> makers_for(const World& world) {
  std::vector<Maker> makers = {{"locus", false, [] { return std::make_unique<Ours>(); }}};
  for (Maker& maker : peer_makers())
    if (!maker.one_size_only || has_one_size(world.kind())) makers.push_back(std::move(maker));
  return makers;
}

}  // namespace locus::bench::dynamic
