#include "tests/bench/frame/race.h"

#include <time.h>

#include "tests/bench/frame/statistics.h"

namespace locus::bench {
namespace {

double seconds_of(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// Runs one round and returns the seconds of each contestant.
std::vector<double> one_round(const std::vector<Contestant>& contestants, size_t chunks, double (*clock)()) {
  std::vector<double> seconds(contestants.size());
  for (size_t chunk = 0; chunk < chunks; ++chunk) {
    for (size_t i = 0; i < contestants.size(); ++i) {
      if (contestants[i].prepare) contestants[i].prepare(chunk);
      const double start = clock();
      contestants[i].run(chunk);
      seconds[i] += clock() - start;
    }
  }
  return seconds;
}

}  // namespace

double thread_seconds() { return seconds_of(CLOCK_THREAD_CPUTIME_ID); }
double process_seconds() { return seconds_of(CLOCK_PROCESS_CPUTIME_ID); }
double wall_seconds() { return seconds_of(CLOCK_MONOTONIC); }

std::vector<std::vector<double>> race(const std::vector<Contestant>& contestants, size_t chunks, int rounds,
                                      double (*clock)(), WarmUp warm_up) {
  std::vector<std::vector<double>> times(contestants.size());
  if (warm_up == WarmUp::kOneRound) one_round(contestants, chunks, clock);
  for (int round = 0; round < rounds; ++round) {
    const std::vector<double> seconds = one_round(contestants, chunks, clock);
    for (size_t i = 0; i < contestants.size(); ++i) times[i].push_back(1e9 * seconds[i] / contestants[i].operations);
  }
  return times;
}

void add_cells(const std::vector<Contestant>& contestants, const std::vector<std::vector<double>>& times,
               const Cell& cell, Report& report) {
  for (size_t i = 1; i < contestants.size(); ++i) {
    const std::vector<double> ratios = round_ratios(times[0], times[i]);
    Cell full = cell;
    full.ours = median(times[0]);
    full.peer = median(times[i]);
    full.peer_name = contestants[i].name;
    full.ratio = median(ratios);
    full.spread = spread(ratios);
    report.add(full);
  }
}

}  // namespace locus::bench
