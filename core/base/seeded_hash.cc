#include "core/base/seeded_hash.h"

#include <random>

namespace locus {

const SeededHash::Seed& SeededHash::process_seed() {
  static const Seed kSeed = [] {
    std::random_device device;
    std::uniform_int_distribution<uint64_t> distribution;
    const uint64_t mask = distribution(device);
    return Seed{mask, distribution(device)};
  }();
  return kSeed;
}

}  // namespace locus
