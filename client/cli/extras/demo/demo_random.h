// Random number generator of the demo. Equal seeds give equal numbers on every machine. Not thread-safe.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_DEMO_DEMO_RANDOM_H_
#define LOCUS_CLIENT_CLI_EXTRAS_DEMO_DEMO_RANDOM_H_

#include "client/cli/levels/generate/splitmix64.h"
#include "core/geometry/vec3.h"

namespace locus::cli {

class DemoRandom {
 public:
  explicit DemoRandom(uint64_t seed) : random_(seed) {}

  uint64_t next() { return random_.next(); }
  // Returns a random number u, 0 <= u < 1.
  float unit() { return static_cast<float>(random_.next() >> 40) * 0x1p-24f; }
  // Returns a random number u, -1 <= u < 1.
  float sign() { return 2 * unit() - 1; }
  // Returns a random point in the cube -1 <= x, y, z < 1.
  Vec3f cube() {
    const float x = sign(), y = sign(), z = sign();
    return {x, y, z};
  }
  // Returns a random vector that is not zero, between 0.1 and sqrt(3) long.
  Vec3f direction() {
    Vec3f d = cube();
    while (squared_length(d) < 0.01f) d = cube();
    return d;
  }

 private:
  SplitMix64 random_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_DEMO_DEMO_RANDOM_H_
