// A uniform world that readers and a writer use at the same time, for one window of time after another. Each window
// starts its own threads and joins them at its end.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_ARENA_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_ARENA_H_

#include <atomic>
#include <vector>

#include "tests/bench/dynamic/mixed_batches.h"
#include "tests/bench/dynamic/ours.h"
#include "tests/bench/dynamic/scattered_writer.h"

namespace locus::bench::dynamic {

// Load that runs at the same time as the readers: none, a thread that only spins, or the writer. The spinning thread
// shows how much a busy second core alone slows the readers.
enum class Beside : uint8_t { kNothing, kSpinning, kWriter };

// Priority of readers relative to the writer. kEqual: equal. kBelow: lower, like the priority of the daemon's threads
// for large batches.
enum class Readers : uint8_t { kEqual, kBelow };

inline constexpr double kUnpaced = 0;

struct Window {
  double seconds = 1;
  uint32_t readers = 1;
  Beside beside = Beside::kNothing;
  size_t batch = 1000;     // moves per revision
  double rate = kUnpaced;  // moves per second; kUnpaced: as many as possible
  Readers stand = Readers::kEqual;
};

struct Seen {
  std::vector<double> latencies;  // seconds of each batch of 100 queries; interrupted batches are left out
  uint64_t interrupted = 0;       // number of batches during which the kernel preempted the reader
  double moves_a_second = 0;
  double moves_a_computed_second = 0;  // moves per second of the writer thread's processor time
  uint64_t wrong_counts = 0;           // number of counted revisions in which an object was missing or present twice
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
