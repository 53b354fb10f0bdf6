#include "core/base/seeded_hash.h"

#include <random>

namespace locus {

const SeededHash::Seed& SeededHash::of_process() {
  static const Seed seed = [] {
    std::random_device device;
    std::uniform_int_distribution<uint64_t> numbers;
    const uint64_t mask = numbers(device);
    return Seed{mask, numbers(device)};
  }();
  return seed;
}

}  // namespace locus
