// Races: the same work by several contestants in one process, interleaved in small chunks, so that other load on the
// machine disturbs all of them equally. Used by every suite that measures in process. One thread runs a race.
#ifndef LOCUS_TESTS_BENCH_FRAME_RACE_H_
#define LOCUS_TESTS_BENCH_FRAME_RACE_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tests/bench/frame/cell.h"

namespace locus::bench {

// Clocks, in seconds: processor time of this thread, processor time of the process, and wall time.
double thread_seconds();
double process_seconds();
double wall_seconds();

struct Contestant {
  std::string name;
  std::function<void(size_t chunk)> run;
  double operations = 1;                      // operations in all chunks; race() divides a round's time by it
  std::function<void(size_t chunk)> prepare;  // runs before each chunk, while the clock is stopped; may be empty
};

// Warm-up of the caches: one round of race() that is not counted, or none, if all contestants have just done the same
// work.
enum class WarmUp : uint8_t { kOneRound, kDone };

// Returns nanoseconds per operation: one row for each contestant, one column for each round. In a round, all
// contestants run the first chunk, then all run the second chunk, and so on. The warm-up round is not counted.
std::vector<std::vector<double>> race(const std::vector<Contestant>& contestants, size_t chunks, int rounds,
                                      double (*clock)(), WarmUp warm_up = WarmUp::kOneRound);

// Adds one cell for each contestant except the first, which is locus. `cell` has the fields that are equal in all
// cells; `times` is a result of race().
void add_cells(const std::vector<Contestant>& contestants, const std::vector<std::vector<double>>& times,
               const Cell& cell, Report& report);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_FRAME_RACE_H_
