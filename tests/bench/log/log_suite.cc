#include "tests/bench/log/log_suite.h"

#include <algorithm>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "server/storage/rocksdb_log.h"
#include "tests/bench/frame/bar.h"
#include "tests/bench/frame/race.h"
#include "tests/bench/frame/statistics.h"
#include "tests/bench/frame/temporary_folder.h"
#include "tests/bench/log/log_run.h"
#include "tests/bench/log/log_scenes.h"
#include "tests/bench/log/mesh_case.h"
#include "tests/bench/log/move_records.h"
#include "tests/bench/log/raw_file.h"

namespace locus::bench::log {
namespace {

constexpr size_t kWriters = 8;

struct Size {
  size_t moves;
  size_t commits;  // number of commits in a chunk
  double bar;
};
constexpr Size kSizes[] = {{16, 400, 0.8}, {256, 400, 0.8}, {4096, 100, 0.6}};

size_t commits_of(const LogRun& run, const Size& size) { return run.options.quick ? size.commits / 20 : size.commits; }
// Returns the number of commits in all rounds, including the warm-up round.
size_t commits_of_all(const LogRun& run, const Size& size) {
  return commits_of(run, size) * run.chunks() * static_cast<size_t>(run.options.rounds + 1);
}

void hash_of(absl::string_view bytes, ResultsHash& hash) {
  for (const char byte : bytes) hash.add(static_cast<uint8_t>(byte));
}

// Creates a data directory with empty scenes, as the daemon does.
absl::StatusOr<LogScenes> create_log(const std::string& path, size_t scenes) {
  server::StorageOptions options;
  options.path = path;
  auto log = server::RocksdbLog::open(options);
  if (!log.ok()) return log.status();
  return LogScenes::create(*std::move(log), "scene", scenes);
}

constexpr const char* kMetric = "ns/commit";

// Measures one writer, whose next commit begins when the previous one is on the disk.
absl::Status measure_commits(const LogRun& run, const Size& size) {
  const std::string name = absl::StrCat("commit/", size.moves);
  if (!run.options.filter.wants(name)) return absl::OkStatus();
  run.progress(name);
  const std::vector<std::string> records = move_records(size.moves, commits_of(run, size));
  const TemporaryFolder folder;
  auto ours = create_log(folder.file("data"), 1);
  if (!ours.ok()) return ours.status();
  const uint64_t reserved = commits_of_all(run, size) * records.front().size();
  auto plain = RawFile::create(folder.file("plain"), 0);
  auto overwritten = RawFile::create(folder.file("overwritten"), reserved);
  if (!plain.ok()) return plain.status();
  if (!overwritten.ok()) return overwritten.status();

  absl::Status status;
  const auto through = [&](auto append) {
    return [&status, &records, append](size_t) {
      for (const std::string& record : records) status.Update(append(record));
    };
  };
  const auto count = static_cast<double>(records.size() * run.chunks());
  const std::vector<Contestant> contestants = {
      {"locus", through([&](const std::string& record) { return ours->append(0, record); }), count, {}},
      {"append", through([&](const std::string& record) { return (*plain)->append(record); }), count, {}},
      {"overwrite", through([&](const std::string& record) { return (*overwritten)->append(record); }), count, {}}};
  const auto times = race(contestants, run.chunks(), run.options.rounds, wall_seconds);
  if (!status.ok()) return status;

  const auto logged = ours->read_all(0);
  const auto appended = (*plain)->read_all();
  if (!logged.ok()) return logged.status();
  if (!appended.ok()) return appended.status();
  if (*logged != *appended) run.report.disagreements.push_back(absl::StrCat(name, ": not what was written"));
  ResultsHash hash;
  hash_of(*logged, hash);
  Report cells;
  add_cells(contestants, times, cell_of(name, kMetric, hash), cells);
  for (Cell& cell : cells.cells) {
    const bool has_bar = cell.peer_name == "append";
    run.report.add(std::move(cell));
    if (has_bar) note_bar(run.report, size.bar);
  }
  run.report.notes.push_back(
      absl::StrFormat("%s: %.0f commits a second of %d bytes", name, 1e9 / median(times[0]), records.front().size()));
  return status;
}

// Measures writers that each have a scene and a thread. One sync of the log can serve the commits of all writers.
absl::Status measure_writers(const LogRun& run, const Size& size) {
  const std::string name = absl::StrCat("writers/", kWriters, "/", size.moves);
  if (!run.options.filter.wants(name)) return absl::OkStatus();
  run.progress(name);
  const std::vector<std::string> records =
      move_records(size.moves, std::max<size_t>(1, commits_of(run, size) / kWriters));
  const TemporaryFolder folder;
  auto ours = create_log(folder.file("data"), kWriters + 1);
  if (!ours.ok()) return ours.status();
  std::vector<absl::Status> statuses(kWriters + 1);
  const auto write = [&](size_t scene) {
    for (const std::string& record : records) statuses[scene].Update(ours->append(scene, record));
  };
  const auto together = [&](size_t) {
    std::vector<std::thread> writers;
    for (size_t scene = 0; scene < kWriters; ++scene) writers.emplace_back(write, scene);
    for (std::thread& writer : writers) writer.join();
  };
  const auto alone = [&](size_t) {
    for (size_t i = 0; i < kWriters; ++i) write(kWriters);
  };
  const auto count = static_cast<double>(kWriters * records.size() * run.chunks());
  const std::vector<Contestant> contestants = {{"together", together, count, {}}, {"one_writer", alone, count, {}}};
  const auto times = race(contestants, run.chunks(), run.options.rounds, wall_seconds);
  for (const absl::Status& status : statuses)
    if (!status.ok()) return status;

  std::string sent;
  for (size_t chunk = 0; chunk < run.chunks() * static_cast<size_t>(run.options.rounds + 1); ++chunk)
    for (const std::string& record : records) sent += record;
  ResultsHash hash;
  hash_of(sent, hash);
  for (size_t scene = 0; scene < kWriters; ++scene) {
    const auto logged = ours->read_all(scene);
    if (!logged.ok()) return logged.status();
    if (*logged != sent) run.report.disagreements.push_back(absl::StrCat(name, ": not what was written"));
  }
  add_cells(contestants, times, cell_of(name, kMetric, hash), run.report);
  constexpr double kBar = 2;
  if (size.moves == 256) note_bar(run.report, kBar);
  return absl::OkStatus();
}

}  // namespace

absl::Status run_log_suite(const Options& options, const Progress& progress, Report& report) {
  const LogRun run{options, progress, report};
  for (const Size& size : kSizes)
    if (absl::Status status = measure_commits(run, size); !status.ok()) return status;
  for (const Size& size : kSizes)
    if (absl::Status status = measure_writers(run, size); !status.ok()) return status;
  return measure_mesh(run);
}

}  // namespace locus::bench::log
