// Generator of random numbers and geometry for tests: equal seeds give equal results on every machine. One thread at a
// time.
#ifndef LOCUS_TESTS_SUPPORT_RANDOM_H_
#define LOCUS_TESTS_SUPPORT_RANDOM_H_

#include <cmath>
#include <cstdint>
#include <iterator>
#include <utility>

#include "core/geometry/rotation.h"

namespace locus::test {

// Source of the generator: Steele, Lea, Flood, Fast Splittable Pseudorandom Number Generators, 2014 (splitmix64).
class Random {
 public:
  explicit Random(uint64_t seed) : state_(seed) {}

  uint64_t next() {
    uint64_t z = (state_ += 0x9E3779B97F4A7C15u);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
  }
  uint64_t below(uint64_t n) { return next() % n; }
  bool chance(double probability) { return unit() < probability; }
  // Returns a random number in [0, 1).
  double unit() { return static_cast<double>(next() >> 11) * 0x1p-53; }
  double between(double low, double high) { return low + (high - low) * unit(); }
  float float_between(double low, double high) { return static_cast<float>(between(low, high)); }
  // Returns a random magnitude from 2^low to 2^high, whose logarithm is uniformly distributed.
  double magnitude(double low, double high) { return std::exp2(between(low, high)); }
  int whole(int low, int high) { return low + static_cast<int>(below(static_cast<uint64_t>(high - low + 1))); }

  Vec3d vector(double size) { return {between(-size, size), between(-size, size), between(-size, size)}; }
  Vec3f float_vector(double size) { return to_float(vector(size)); }
  Vec3d whole_vector(int size) {
    return {double(whole(-size, size)), double(whole(-size, size)), double(whole(-size, size))};
  }
  Vec3d positive_vector(double size) { return {between(0, size), between(0, size), between(0, size)}; }
  Vec3d unit_vector() {
    for (;;) {
      const Vec3d v = vector(1);
      const double length = squared_length(v);
      if (length > 1e-4 && length <= 1) return locus::normalized(v);
    }
  }
  // Returns a random element of an array or vector that is not empty.
  template <class Range>
  const auto& pick(const Range& from) {
    return from[below(std::size(from))];
  }
  template <class Range>
  void shuffle(Range& items) {
    for (size_t i = std::size(items); i > 1; --i) std::swap(items[i - 1], items[below(i)]);
  }
  Quaternion rotation() {
    for (;;) {
      const Quaternion q = {float_between(-1, 1), float_between(-1, 1), float_between(-1, 1), float_between(-1, 1)};
      if (unit_deviation(q) < 0.9) return normalized(q);
    }
  }

 private:
  uint64_t state_;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_RANDOM_H_
