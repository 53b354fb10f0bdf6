// Races: the same work by several contestants in one process, interleaved in small chunks, so that whatever else the
// machine does disturbs all of them alike. For every suite that measures in process; one thread runs a race.
#ifndef LOCUS_TESTS_BENCH_FRAME_RACE_H_
#define LOCUS_TESTS_BENCH_FRAME_RACE_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tests/bench/frame/cell.h"

namespace locus::bench {

// The time this thread has computed, what the whole process has, and what has passed; in seconds.
double thread_seconds();
double process_seconds();
double wall_seconds();

struct Contestant {
  std::string name;
  std::function<void(size_t chunk)> run;
  double operations = 1;                      // in all chunks together: what a time is divided by
  std::function<void(size_t chunk)> prepare;  // before the clock starts; may be empty
};

// kDone: all have just done the same work already.
enum class WarmUp : uint8_t { kOneRound, kDone };

// Nanoseconds an operation: one row a contestant, one column a round. A round is all contestants at the first chunk,
// then all at the second and so on; the one to warm up goes before and is not counted.
std::vector<std::vector<double>> race(const std::vector<Contestant>& contestants, size_t chunks, int rounds,
                                      double (*clock)(), WarmUp warm_up = WarmUp::kOneRound);

// The first contestant is ours: one cell for each of the others. `cell` has what they share.
void add_cells(const std::vector<Contestant>& contestants, const std::vector<std::vector<double>>& times,
               const Cell& cell, Report& report);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_FRAME_RACE_H_
