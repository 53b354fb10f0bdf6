// A writer of moves without locality: batches of objects in a stride of 7919, all of them once, then all again one tick
// on, then back. The columns are made beforehand, as a message that was received. One thread.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_SCATTERED_WRITER_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_SCATTERED_WRITER_H_

#include <array>
#include <vector>

#include "tests/bench/dynamic/world.h"

namespace locus::bench::dynamic {

class ScatteredWriter {
 public:
  // Takes the world one tick on. The count of objects is a multiple of every batch.
  explicit ScatteredWriter(World& world);

  // Moves the next objects, so many.
  void move(Contender& contender, size_t batch);

 private:
  std::vector<uint64_t> ids_;
  std::vector<float> velocities_;
  std::array<std::vector<float>, 2> positions_;  // by turns
  size_t next_ = 0, turn_ = 0;
};

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_SCATTERED_WRITER_H_
