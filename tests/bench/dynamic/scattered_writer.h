// A writer of moves without locality: consecutive objects of a batch are 7919 apart in the world's order. All objects
// are moved to their positions of the next tick, batch by batch, then all are moved back, and so on. The columns are
// made beforehand, as if they had been received. One thread.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_SCATTERED_WRITER_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_SCATTERED_WRITER_H_

#include <array>
#include <vector>

#include "tests/bench/dynamic/world.h"

namespace locus::bench::dynamic {

class ScatteredWriter {
 public:
  // Makes the columns, and advances the world by one tick for this. The number of objects must be a multiple of the
  // size of every batch.
  explicit ScatteredWriter(World& world);

  // Moves the next `batch` objects.
  void move(Contender& contender, size_t batch);

 private:
  std::vector<uint64_t> ids_;
  std::vector<float> velocities_;
  std::array<std::vector<float>, 2> positions_;  // [0]: after the tick, [1]: before the tick; used alternately
  size_t next_ = 0, turn_ = 0;
};

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_SCATTERED_WRITER_H_
