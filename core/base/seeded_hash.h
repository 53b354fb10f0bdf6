// Fast hash of ids that clients choose. The hash is seeded at random in every process, so that clients cannot choose
// ids that collide in a table. The hash of an id differs between processes, so query results must not depend on
// hashes. A SeededHash is a value that any number of threads may use at the same time.
//
// The upper bits of the hash are distributed as evenly as the lower bits. Sources: Yi, wyhash (products folded into 64
// bits); Dietzfelbinger et al., A Reliable Randomized Algorithm for the Closest-Pair Problem, 1997 (random multiplier).
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

  // Uses the random seed of this process.
  SeededHash() : SeededHash(process_seed()) {}
  explicit SeededHash(const Seed& seed) : mask_(seed.mask), multiplier_(seed.multiplier | 1) {}

  uint64_t operator()(uint64_t key) const { return folded_product(folded_product(key ^ mask_, multiplier_), kMixer); }

 private:
  // Returns the exclusive or of the two 64-bit halves of the product a * b. The lower half alone would not suffice: its
  // low bits do not depend on the high bits of `a`.
  static uint64_t folded_product(uint64_t a, uint64_t b) {
    const absl::uint128 product = absl::uint128(a) * b;
    return absl::Uint128Low64(product) ^ absl::Uint128High64(product);
  }
  // Returns the random seed of this process.
  static const Seed& process_seed();

  // Odd constant without a regular bit pattern (fractional part of the golden ratio). The hash multiplies twice: first
  // by the random multiplier, then by this constant, which separates keys whose first products are similar.
  static constexpr uint64_t kMixer = 0x9E3779B97F4A7C15;

  uint64_t mask_;
  uint64_t multiplier_;
};

}  // namespace locus

#endif  // LOCUS_CORE_BASE_SEEDED_HASH_H_
