// One uniform world that readers and a writer share for windows of time. The threads of a window are its own; between
// windows nothing runs.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_ARENA_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_ARENA_H_

#include <atomic>
#include <vector>

#include "tests/bench/dynamic/mixed_batches.h"
#include "tests/bench/dynamic/ours.h"
#include "tests/bench/dynamic/scattered_writer.h"

namespace locus::bench::dynamic {

// What runs beside the readers: nothing, a thread that only counts (what a busy second core costs by itself), or the
// writer.
enum class Beside : uint8_t { kNothing, kSpinning, kWriter };

// How readers stand beside the writer: as equals, or as the daemon's threads for large batches do.
enum class Readers : uint8_t { kEqual, kBelow };

inline constexpr double kUnpaced = 0;

struct Window {
  double seconds = 1;
  uint32_t readers = 1;
  Beside beside = Beside::kNothing;
  size_t batch = 1000;     // moves a revision
  double rate = kUnpaced;  // moves a second, or as many as there can be
  Readers stand = Readers::kEqual;
};

struct Seen {
  std::vector<double> latencies;  // seconds of each batch of 100 queries, of all readers, but for the interrupted
  uint64_t interrupted = 0;       // batches during which the kernel gave the core to somebody else
  double moves_a_second = 0;
  double moves_a_computed_second = 0;  // of the writer's thread, whatever else the machine did meanwhile
  uint64_t wrong_counts = 0;           // revisions that did not hold every object once, of those that were counted
};

class Arena {
 public:
  explicit Arena(uint32_t count);

  Seen run(const Window& window);

 private:
  void write(const Window& window, Seen& seen);
  void read(size_t first_batch, Seen& seen) const;

  World world_;
  MixedBatches batches_;
  Ours ours_;
  ScatteredWriter writer_;
  std::atomic<bool> stop_ = false;
};

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_ARENA_H_
