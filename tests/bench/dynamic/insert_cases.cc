#include "tests/bench/dynamic/insert_cases.h"

#include "client/cli/levels/generate/splitmix64.h"
#include "tests/bench/dynamic/query_cases.h"
#include "tests/bench/frame/race.h"
#include "tests/bench/frame/results_hash.h"

namespace locus::bench::dynamic {
namespace {

constexpr uint32_t kReinserted = 10;  // the case reinsert uses one of every 10 objects

// Columns of the objects that are reinserted.
struct Some {
  std::vector<uint64_t> ids;
  std::vector<float> positions, radii;

  Objects objects() const { return {ids, positions, radii}; }
};

Some drawn(const World& world) {
  const Objects all = world.objects();
  Some some;
  cli::SplitMix64 numbers(9);
  std::vector<bool> seen(world.count());
  while (some.ids.size() < world.count() / kReinserted) {
    const size_t i = numbers.next() % world.count();
    if (seen[i]) continue;
    seen[i] = true;
    some.ids.push_back(all.ids[i]);
    some.radii.push_back(all.radii[i]);
    some.positions.insert(some.positions.end(), &all.positions[3 * i], &all.positions[3 * i] + 3);
  }
  return some;
}

}  // namespace

void run_insert_case(const WorldRun& run) {
  const std::string name = run.case_of("insert");
  if (!run.options.filter.wants(name)) return;
  std::vector<Contestant> contestants;
  const std::vector<Maker> makers = makers_for(run.world);
  std::vector<std::unique_ptr<Contender>> made(makers.size());
  for (const Maker& maker : makers) {
    std::unique_ptr<Contender>& mine = made[contestants.size()];
    const auto load = [&mine, &run](size_t) { mine->load(run.world.objects()); };
    const auto prepare = [&mine, &maker](size_t) {
      mine.reset();
      mine = maker.make();
    };
    contestants.push_back({maker.name, load, static_cast<double>(run.world.count()), prepare});
  }
  const auto times = race(contestants, 1, run.options.rounds, thread_seconds);
  add_cells(contestants, times, cell_of(name, "ns/object", hash_of_number(run.world.count())), run.report);
}

void run_reinsert_case(const WorldRun& run) {
  const std::string name = run.case_of("reinsert");
  if (!run.options.filter.wants(name)) return;
  const Some some = drawn(run.world);
  std::vector<Contestant> contestants;
  for (const Entrant& entrant : run.entrants) {
    Contender* const contender = entrant.contender.get();
    if (!contender->does(Task::kReinsert)) continue;
    const auto reinsert = [contender, &some](size_t) {
      contender->remove(some.ids);
      contender->insert(some.objects());
    };
    contestants.push_back({contender->name(), reinsert, 2.0 * static_cast<double>(some.ids.size()), {}});
  }
  const auto times = race(contestants, 1, run.options.rounds, thread_seconds);
  add_cells(contestants, times, cell_of(name, "ns/operation", compare_some_balls(run, name)), run.report);
}

void run_memory_case(const WorldRun& run) {
  const std::string name = run.case_of("memory");
  if (!run.options.filter.wants(name)) return;
  const auto bytes = [&](const Entrant& entrant) { return static_cast<double>(entrant.bytes) / run.world.count(); };
  for (size_t i = 1; i < run.entrants.size(); ++i) {
    Cell cell = cell_of(name, "bytes/object", hash_of_number(run.world.count()));
    cell.ours = bytes(run.entrants[0]);
    cell.peer = bytes(run.entrants[i]);
    cell.peer_name = run.entrants[i].contender->name();
    cell.ratio = cell.peer / cell.ours;
    run.report.add(cell);
  }
}

}  // namespace locus::bench::dynamic
