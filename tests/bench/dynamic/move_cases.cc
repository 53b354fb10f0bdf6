#include "tests/bench/dynamic/move_cases.h"

#include <algorithm>
#include <numeric>

#include "tests/bench/dynamic/query_cases.h"
#include "tests/bench/frame/race.h"

namespace locus::bench::dynamic {
namespace {

// Columns of the moves of one tick.
struct Tick {
  std::vector<uint64_t> ids;
  std::vector<float> positions, velocities;

  explicit Tick(const Moves& moves)
      : ids(moves.ids.begin(), moves.ids.end()),
        positions(moves.positions.begin(), moves.positions.end()),
        velocities(moves.velocities.begin(), moves.velocities.end()) {}
  Moves moves() const { return {ids, positions, velocities}; }
};

class MoveRace {
 public:
  explicit MoveRace(const WorldRun& run) : run_(run) {}

  void run() {
    // A contender moves a small world by several ticks in one turn: a single tick would mostly measure reloading the
    // caches, which the other contenders have filled with their data.
    const uint32_t count = run_.world.count();
    const size_t ticks = run_.options.quick ? 1 : std::clamp<size_t>(100'000 / count, 1, 8);
    const size_t chunks = run_.options.quick || count >= 1'000'000 ? 1 : 4;
    std::vector<Contestant> contestants;
    for (const Entrant& entrant : run_.entrants)
      if (entrant.contender->does(Task::kMove)) contestants.push_back(contestant(*entrant.contender, ticks * chunks));
    contestants.front().prepare = [this, ticks](size_t) {
      step(ticks);
      touch();
    };
    const std::string name = run_.case_of("move");
    const auto times = race(contestants, chunks, run_.options.rounds, thread_seconds);
    add_cells(contestants, times, cell_of(name, "ns/move", compare_some_balls(run_, name)), run_.report);
  }

 private:
  void step(size_t ticks) {
    ticks_.clear();
    for (size_t i = 0; i < ticks; ++i) {
      run_.world.step();
      ticks_.emplace_back(run_.world.moves());
    }
  }
  // Reads the columns, so that they are in the caches for every contender, as in a server that has just received them.
  void touch() {
    for (const Tick& tick : ticks_)
      touched_ += static_cast<double>(std::accumulate(tick.ids.begin(), tick.ids.end(), uint64_t{0})) +
                  std::accumulate(tick.positions.begin(), tick.positions.end(), 0.0f);
  }
  Contestant contestant(Contender& contender, size_t ticks) {
    const auto run_chunk = [this, &contender](size_t) {
      for (const Tick& tick : ticks_) contender.move(tick.moves());
    };
    return {contender.name(), run_chunk, static_cast<double>(run_.world.count()) * static_cast<double>(ticks),
            [this](size_t) { touch(); }};
  }

  const WorldRun& run_;
  std::vector<Tick> ticks_;
  double touched_ = 0;
};

}  // namespace

void run_move_case(const WorldRun& run) {
  if (run.options.filter.wants(run.case_of("move"))) MoveRace(run).run();
}

}  // namespace locus::bench::dynamic
