// A writer of moves without locality: batches of objects in a stride of 7919, all of them once to the next tick, then
// all of them back, and so on. The columns are made beforehand, like a received message. One thread.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_SCATTERED_WRITER_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_SCATTERED_WRITER_H_

#include <array>
#include <vector>

#include "tests/bench/dynamic/world.h"

namespace locus::bench::dynamic {

class ScatteredWriter {
 public:
  // Advances the world by one tick. The count of objects must be a multiple of every batch size.
  explicit ScatteredWriter(World& world);

  // Moves the next `batch` objects.
  void move(Contender& contender, size_t batch);

 private:
  std::vector<uint64_t> ids_;
  std::vector<float> velocities_;
  std::array<std::vector<float>, 2> positions_;  // used alternately
  size_t next_ = 0, turn_ = 0;
};

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_SCATTERED_WRITER_H_
