#include "tests/bench/cluster/cluster_suite.h"

#include <algorithm>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "server/storage/postgres_log.h"
#include "tests/bench/cluster/bare_client.h"
#include "tests/bench/frame/bar.h"
#include "tests/bench/frame/race.h"
#include "tests/bench/frame/results_hash.h"
#include "tests/bench/frame/statistics.h"
#include "tests/bench/log/log_scenes.h"
#include "tests/bench/log/move_records.h"
#include "tests/support/postgres_server.h"

namespace locus::bench::cluster {
namespace {

constexpr const char* kMetric = "ns/append";

// A primary that waits for one of two standbys, all on this machine.
class Engine {
 public:
  Engine()
      : primary_({"synchronous_standby_names=ANY 1 (two, three)", "max_wal_size=4GB"}),
        second_(primary_, "two"),
        third_(primary_, "three") {}

  server::PostgresOptions options() const { return primary_.options({&second_, &third_}); }
  std::string primary_url() const { return primary_.options().url; }

 private:
  test::PostgresServer primary_, second_, third_;
};

struct Run {
  const Options& options;
  const Progress& progress;
  Report& report;
  const Engine& engine;

  size_t chunks() const { return options.quick ? 1 : 4; }
  size_t appends(size_t moves) const { return (moves == 4096 ? 40 : 200) / (options.quick ? 10 : 1); }
};

using log::LogScenes;

// Opens a log of the engine and creates scenes; appends to each come from a thread of its own.
absl::StatusOr<LogScenes> create_scenes(const server::PostgresOptions& options, const std::string& prefix,
                                        size_t count) {
  auto log = server::PostgresLog::open(options);
  if (!log.ok()) return log.status();
  return LogScenes::create(*std::move(log), prefix, count);
}

// Calls `work` with each number below `count`, each in a thread of its own, and returns the first error.
absl::Status in_threads(size_t count, const std::function<absl::Status(size_t)>& work) {
  std::vector<absl::Status> statuses(count);
  std::vector<std::thread> threads;
  for (size_t i = 0; i < count; ++i) threads.emplace_back([&, i] { statuses[i] = work(i); });
  for (std::thread& thread : threads) thread.join();
  for (const absl::Status& status : statuses)
    if (!status.ok()) return status;
  return absl::OkStatus();
}

absl::Status append_all(size_t scenes, const std::vector<std::string>& records,
                        const std::function<absl::Status(size_t, const std::string&)>& append) {
  return in_threads(scenes, [&](size_t scene) -> absl::Status {
    for (const std::string& record : records)
      if (absl::Status status = append(scene, record); !status.ok()) return status;
    return absl::OkStatus();
  });
}

Cell cell_of(const std::string& name, const std::string& hashed) {
  ResultsHash hash;
  for (const char byte : hashed) hash.add(static_cast<uint8_t>(byte));
  Cell cell;
  cell.suite = "cluster";
  cell.case_name = name;
  cell.metric = kMetric;
  cell.results_hash = hash.text();
  return cell;
}

void add_with_bar(const std::vector<Contestant>& contestants, const std::vector<std::vector<double>>& times,
                  const Cell& cell, double bar, Report& report) {
  Report cells;
  add_cells(contestants, times, cell, cells);
  for (Cell& each : cells.cells) {
    report.add(std::move(each));
    note_bar(report, bar);
  }
  report.notes.push_back(absl::StrFormat("%s: %.0f appends a second", cell.case_name, 1e9 / median(times[0])));
}

// Appends of one or eight scenes, compared with a program that only appends.
absl::Status measure_appends(const Run& run, size_t scenes, size_t moves) {
  const std::string name = absl::StrCat("append/", scenes, "/", moves);
  if (!run.options.filter.wants(name)) return absl::OkStatus();
  run.progress(name);
  const std::vector<std::string> records = log::move_records(moves, run.appends(moves));
  auto ours = create_scenes(run.engine.options(), absl::StrCat(name, "/ours"), scenes);
  if (!ours.ok()) return ours.status();
  std::vector<BareClient> bare;
  for (size_t i = 0; i < scenes; ++i) {
    auto client = BareClient::create(run.engine.primary_url(), absl::StrCat(name, "/bare-", i));
    if (!client.ok()) return client.status();
    bare.push_back(*std::move(client));
  }
  absl::Status status;
  const auto count = static_cast<double>(scenes * records.size() * run.chunks());
  const std::vector<Contestant> contestants = {
      {"locus",
       [&](size_t) {
         status.Update(append_all(
             scenes, records, [&](size_t scene, const std::string& record) { return ours->append(scene, record); }));
       },
       count,
       {}},
      {"bare",
       [&](size_t) {
         status.Update(append_all(scenes, records,
                                  [&](size_t scene, const std::string& record) { return bare[scene].append(record); }));
       },
       count,
       {}}};
  const auto times = race(contestants, run.chunks(), run.options.rounds, wall_seconds);
  if (!status.ok()) return status;
  std::string stored;
  for (size_t scene = 0; scene < scenes; ++scene) {
    const auto logged = ours->read_all(scene), plain = bare[scene].read_all();
    if (!logged.ok()) return logged.status();
    if (!plain.ok()) return plain.status();
    if (*logged != *plain) run.report.disagreements.push_back(absl::StrCat(name, ": not what was appended"));
    stored = *logged;
  }
  constexpr double kBar = 0.8;
  add_with_bar(contestants, times, cell_of(name, stored), kBar, run.report);
  return absl::OkStatus();
}

// Appends of 128 scenes that share commits, compared with those of 8 scenes.
absl::Status measure_sharing(const Run& run) {
  constexpr size_t kMany = 128, kFew = 8, kMoves = 16;
  const std::string name = absl::StrCat("scenes/", kMany, "/", kMoves);
  if (!run.options.filter.wants(name)) return absl::OkStatus();
  run.progress(name);
  const std::vector<std::string> records = log::move_records(kMoves, run.appends(kMoves));
  auto scenes = create_scenes(run.engine.options(), name, kMany + kFew);
  if (!scenes.ok()) return scenes.status();
  absl::Status status;
  const auto contestant = [&](const char* called, size_t first, size_t count) {
    return Contestant{called,
                      [&, first, count](size_t) {
                        status.Update(append_all(count, records, [&, first](size_t scene, const std::string& record) {
                          return scenes->append(first + scene, record);
                        }));
                      },
                      static_cast<double>(count * records.size() * run.chunks()),
                      {}};
  };
  const std::vector<Contestant> contestants = {contestant("together", 0, kMany), contestant("8_scenes", kMany, kFew)};
  const auto times = race(contestants, run.chunks(), run.options.rounds, wall_seconds);
  if (!status.ok()) return status;
  const auto one = scenes->read_all(0), other = scenes->read_all(kMany);
  if (!one.ok()) return one.status();
  if (!other.ok()) return other.status();
  if (*one != *other) run.report.disagreements.push_back(absl::StrCat(name, ": not what was appended"));
  constexpr double kBar = 2;
  add_with_bar(contestants, times, cell_of(name, *one), kBar, run.report);
  return absl::OkStatus();
}

// Appends that wait for a standby, compared with appends that wait for the primary's disk only.
absl::Status measure_quorum(const Run& run) {
  constexpr size_t kMoves = 256;
  const std::string name = absl::StrCat("quorum/", kMoves);
  if (!run.options.filter.wants(name)) return absl::OkStatus();
  run.progress(name);
  const std::vector<std::string> records = log::move_records(kMoves, run.appends(kMoves));
  server::PostgresOptions alone = run.engine.options();
  alone.replication = server::EngineReplication::kStorage;
  alone.url += "&options=-csynchronous_commit%3Dlocal";
  auto quorum = create_scenes(run.engine.options(), absl::StrCat(name, "/quorum"), 1);
  auto local = create_scenes(alone, absl::StrCat(name, "/local"), 1);
  if (!quorum.ok()) return quorum.status();
  if (!local.ok()) return local.status();
  absl::Status status;
  const auto contestant = [&](const char* called, const LogScenes& scenes) {
    return Contestant{called,
                      [&](size_t) {
                        for (const std::string& record : records) status.Update(scenes.append(0, record));
                      },
                      static_cast<double>(records.size() * run.chunks()),
                      {}};
  };
  const std::vector<Contestant> contestants = {contestant("quorum", *quorum), contestant("local_disk", *local)};
  const auto times = race(contestants, run.chunks(), run.options.rounds, wall_seconds);
  if (!status.ok()) return status;
  const auto one = quorum->read_all(0), other = local->read_all(0);
  if (!one.ok()) return one.status();
  if (!other.ok()) return other.status();
  if (*one != *other) run.report.disagreements.push_back(absl::StrCat(name, ": not what was appended"));
  constexpr double kBar = 0.7;
  add_with_bar(contestants, times, cell_of(name, *one), kBar, run.report);
  return absl::OkStatus();
}

}  // namespace

absl::Status run_cluster_suite(const Options& options, const Progress& progress, Report& report) {
  if (!test::PostgresServer::installed()) {
    report.notes.emplace_back("a peer is missing: postgresql");
    return absl::OkStatus();
  }
  const Engine engine;
  const Run run{options, progress, report, engine};
  for (const size_t scenes : {1, 8})
    for (const size_t moves : {16, 256, 4096})
      if (absl::Status status = measure_appends(run, scenes, moves); !status.ok()) return status;
  if (absl::Status status = measure_sharing(run); !status.ok()) return status;
  return measure_quorum(run);
}

}  // namespace locus::bench::cluster
