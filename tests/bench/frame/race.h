// Races: the same work by several contestants in one process, interleaved in small chunks, so that other load on the
// machine disturbs all of them equally. For every suite that measures in process; one thread runs a race.
#ifndef LOCUS_TESTS_BENCH_FRAME_RACE_H_
#define LOCUS_TESTS_BENCH_FRAME_RACE_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tests/bench/frame/cell.h"

namespace locus::bench {

// Returns the processor time of this thread, that of the process, or wall time; in seconds.
double thread_seconds();
double process_seconds();
double wall_seconds();

struct Contestant {
  std::string name;
  std::function<void(size_t chunk)> run;
  double operations = 1;                      // in all chunks together: the divisor of times
  std::function<void(size_t chunk)> prepare;  // runs before the clock starts; may be empty
};

// kDone: all contestants have done the same work just before.
enum class WarmUp : uint8_t { kOneRound, kDone };

// Returns nanoseconds per operation: one row a contestant, one column a round. A round is all contestants at the first
// chunk, then all at the second and so on; the warm-up round before is not counted.
std::vector<std::vector<double>> race(const std::vector<Contestant>& contestants, size_t chunks, int rounds,
                                      double (*clock)(), WarmUp warm_up = WarmUp::kOneRound);

// Adds one cell for each contestant but the first, which is locus. `cell` has the fields that they share.
void add_cells(const std::vector<Contestant>& contestants, const std::vector<std::vector<double>>& times,
               const Cell& cell, Report& report);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_FRAME_RACE_H_
