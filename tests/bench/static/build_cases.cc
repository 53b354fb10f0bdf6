#include "tests/bench/static/build_cases.h"

#include "tests/bench/frame/race.h"
#include "tests/bench/static/ours.h"
#include "tests/bench/static/peers.h"

namespace locus::bench {
namespace {

using Builders = std::vector<std::unique_ptr<Builder>>;

// Measures the builders by the processor time of the whole process, so that the work of all their threads counts.
void run_build(const std::string& name, const MeshRun& run, const Builders& builders, const Cell& shared) {
  run.progress(name);
  const auto count = static_cast<double>(run.mesh.triangles.size());
  std::vector<Contestant> contestants;
  for (const auto& builder : builders) {
    Builder* const one = builder.get();
    contestants.push_back({one->name(), [one](size_t) { one->build(); }, count, [one](size_t) { one->prepare(); }});
  }
  const auto times = race(contestants, 1, run.options.rounds, process_seconds);
  Cell cell = shared;
  cell.case_name = name;
  cell.metric = "ns/triangle";
  add_cells(contestants, times, cell, run.report);
}

void run_memory(const std::string& name, const MeshRun& run, const Builders& builders, const Cell& shared) {
  run.progress(name);
  const auto bytes = [&](Builder& builder) {
    builder.prepare();
    builder.build();
    return static_cast<double>(builder.bytes()) / static_cast<double>(run.mesh.triangles.size());
  };
  const double ours = bytes(*builders.front());
  for (size_t i = 1; i < builders.size(); ++i) {
    Cell cell = shared;
    cell.case_name = name;
    cell.metric = "bytes/triangle";
    cell.ours = ours;
    cell.peer = bytes(*builders[i]);
    cell.peer_name = builders[i]->name();
    cell.ratio = cell.peer / cell.ours;
    run.report.add(cell);
  }
}

}  // namespace

void run_build_cases(const MeshRun& run) {
  const std::string build = case_of("build", run.mesh), memory = case_of("memory", run.mesh);
  const bool wants_build = run.options.filter.wants(build), wants_memory = run.options.filter.wants(memory);
  if (!wants_build && !wants_memory) return;
  Builders builders;
  builders.push_back(our_builder(run.mesh));
  for (auto& peer : all_builders(run.mesh)) builders.push_back(std::move(peer));
  Cell shared;
  shared.suite = "static";
  shared.results_hash = storage_order_hash(run.mesh);
  if (wants_build) run_build(build, run, builders, shared);
  if (wants_memory) run_memory(memory, run, builders, shared);
}

}  // namespace locus::bench
