// A hash of ids that others choose: fast, and seeded anew in every process, so that nobody can choose ids that meet in
// a table. No answer may depend on it. A value type; any thread.
//
// Its upper bits are as good as its lower ones. Source: products folded into 64 bits as in Yi, wyhash; the secret
// multiplier as in Dietzfelbinger et al., A Reliable Randomized Algorithm for the Closest-Pair Problem, 1997.
#ifndef LOCUS_CORE_BASE_SEEDED_HASH_H_
#define LOCUS_CORE_BASE_SEEDED_HASH_H_

#include <cstdint>

#include "absl/numeric/int128.h"

namespace locus {

class SeededHash {
 public:
  struct Seed {
    uint64_t mask;
    uint64_t multiplier;
  };

  SeededHash() : SeededHash(of_process()) {}
  explicit SeededHash(const Seed& seed) : mask_(seed.mask), multiplier_(seed.multiplier | 1) {}

  uint64_t operator()(uint64_t key) const { return folded_product(folded_product(key ^ mask_, multiplier_), kMixer); }

 private:
  // Both halves of the product: what the lower one loses of the upper bits of keys is in the other.
  static uint64_t folded_product(uint64_t a, uint64_t b) {
    const absl::uint128 product = absl::uint128(a) * b;
    return absl::Uint128Low64(product) ^ absl::Uint128High64(product);
  }
  // Random, and the same until the process ends.
  static const Seed& of_process();

  // Any odd number without a pattern, here of the golden ratio: spreads what an unlucky multiplier left together.
  static constexpr uint64_t kMixer = 0x9E3779B97F4A7C15;

  uint64_t mask_;
  uint64_t multiplier_;
};

}  // namespace locus

#endif  // LOCUS_CORE_BASE_SEEDED_HASH_H_
