// Small deterministic random number generator with equal results on every machine. For generators and tests; not
// cryptographic. Each object is used by one thread.
#ifndef LOCUS_CLIENT_CLI_LEVELS_GENERATE_SPLITMIX64_H_
#define LOCUS_CLIENT_CLI_LEVELS_GENERATE_SPLITMIX64_H_

#include <cstdint>

namespace locus::cli {

// SplitMix64 generator. Every seed is suitable; seeds that differ by one give unrelated streams. Source: Steele, Lea,
// Flood, Fast Splittable Pseudorandom Number Generators, 2014 (the mixing of Java's SplittableRandom).
class SplitMix64 {
 public:
  explicit constexpr SplitMix64(uint64_t seed) : state_(seed) {}

  // Returns a uniformly distributed 64-bit integer.
  constexpr uint64_t next() {
    state_ += 0x9E3779B97F4A7C15u;
    uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
  }

  // Returns an integer in 0 .. bound - 1. The distribution is uniform except for a bias below bound / 2^32. `bound`
  // must not be 0.
  constexpr uint32_t below(uint32_t bound) { return static_cast<uint32_t>(((next() >> 32) * bound) >> 32); }

  // Returns a multiple of 2^-53, uniformly distributed over 0 <= x < 1.
  constexpr double unit() { return static_cast<double>(next() >> 11) * 0x1p-53; }

 private:
  uint64_t state_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_GENERATE_SPLITMIX64_H_
