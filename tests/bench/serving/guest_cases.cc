#include "tests/bench/serving/guest_cases.h"

#include <algorithm>

#include "tests/bench/serving/good_client.h"
#include "tests/bench/serving/guest_process.h"
#include "tests/bench/serving/ray_batches.h"

namespace locus::bench::serving {
namespace {

// Returns the number of silent readers in each case: one, and many.
std::vector<size_t> silent_readers(const ServingRun& run) { return {1, run.options.quick ? size_t{8} : size_t{32}}; }
size_t churners(const ServingRun& run) { return run.options.quick ? 50 : 1000; }
std::string silent_name(size_t readers) { return absl::StrCat("silent_reader/", readers); }
std::string churn_name(const ServingRun& run) { return absl::StrCat("churn/", churners(run)); }

double mib(int64_t bytes) { return static_cast<double>(bytes) / (1 << 20); }

class GuestCases {
 public:
  GuestCases(const ServingRun& run, const BenchMesh& mesh) : run_(run), mesh_(mesh) {}

  // Measures clients that never read. Their queries have long answers but need little work, so that unread answers are
  // the load.
  absl::Status silent(size_t readers) const {
    const std::string name = silent_name(readers);
    if (!run_.wants(name)) return absl::OkStatus();
    constexpr int kRays = 8192;
    v1::QueryBatch batch = batches_of(scattered_rays(mesh_, kRays), kRays, "").messages.front().batch();
    for (float& t_max : *batch.mutable_blocks(0)->mutable_rays()->mutable_t_max()) t_max = 0;
    return beside(name, "silent", readers, batch);
  }

  absl::Status churn() const {
    const std::string name = churn_name(run_);
    if (!run_.wants(name)) return absl::OkStatus();
    constexpr size_t kRays = GoodClient::kRays;
    return beside(name, "churn", churners(run_),
                  batches_of(scattered_rays(mesh_, kRays), kRays, "").messages.front().batch());
  }

 private:
  // Open files and resident bytes of the server while the good client is its only client.
  struct Held {
    int64_t files = 0, bytes = 0;
  };
  struct LeftBehind {
    Held before, first, last;
    int64_t most = 0;
  };

  // Measures the good client on a new daemon: alone, and while guests of the kind `kind` run. Guests of churn end by
  // themselves; silent guests are killed.
  absl::Status beside(const std::string& name, const std::string& kind, size_t guests,
                      const v1::QueryBatch& batch) const {
    run_.progress(name);
    const auto daemon = Daemon::start({kManyNewConnections});
    if (!daemon.ok()) return daemon.status();
    TwinScene scene(**daemon, "guests");
    absl::Status status = scene.create();
    status.Update(scene.place(mesh_));
    if (!status.ok()) return status;
    const size_t small = GoodClient::kRays;
    GoodClient good(run_, scene, name, batches_of(scattered_rays(mesh_, 64 * small), small, scene.name()));
    const GuestProgram program(**daemon, kind, guests, scene.name(), batch);
    std::vector<double> idle, crowded;
    LeftBehind left;
    for (int round = 0; status.ok() && round <= run_.options.rounds; ++round) {
      std::vector<double> alone, together;
      good.ask(count(), alone);
      if (round == 0) left.before = held(**daemon, 0);
      status.Update(while_they_are_there(program, good, together));
      left.most = std::max(left.most, (*daemon)->process().resident_bytes());
      status.Update(good.status());
      left.last = held(**daemon, left.before.files);
      if (round == 0) left.first = left.last;
      if (round == 0 || !status.ok()) continue;
      idle.push_back(1e6 * percentile(alone, 0.99));
      crowded.push_back(1e6 * percentile(together, 0.99));
    }
    if (!status.ok()) return status;
    add_cell(run_, cell_of(name, "us/batch p99", hash_of_number(good.expected().front())), "idle", crowded, idle,
             Better::kLess);
    constexpr double kBar = 1.0 / 5;
    note_bar(run_.report, kBar, " = 1/5");
    note_left_behind(name, left);
    return status;
  }

  absl::Status while_they_are_there(const GuestProgram& program, GoodClient& good, std::vector<double>& seconds) const {
    const absl::StatusOr<std::unique_ptr<Process>> guests = program.start();
    if (!guests.ok()) return guests.status();
    constexpr double kUntilStuck = 0.5;  // minimum seconds, so that flow control stops the silent guests
    const double start = wall_seconds();
    const auto enough = [&] { return seconds.size() >= count() && wall_seconds() - start > kUntilStuck; };
    while (good.status().ok() && !(*guests)->has_ended() && (program.ends() || !enough()))
      good.ask(GoodClient::kRays, seconds);
    const bool as_they_should = program.ends() ? (*guests)->exit_code() == 0 : !(*guests)->has_ended();
    return as_they_should ? absl::OkStatus() : absl::DataLossError("the guests were not served: " + program.log());
  }

  size_t count() const { return run_.options.quick ? 300 : 5000; }

  // Waits up to 5 s until no more than `files` files are open, since connections close shortly after their calls. Then
  // returns the resources.
  static Held held(const Daemon& daemon, int64_t files) {
    constexpr double kMaxSeconds = 5, kPatience = 0.02;
    for (double waited = 0; waited < kMaxSeconds && daemon.process().open_files() > files; waited += kPatience)
      sleep_seconds(kPatience);
    return {daemon.process().open_files(), daemon.process().resident_bytes()};
  }

  // Notes whether the server released the guests' resources. The server keeps freed memory for later guests, so its
  // memory is compared with its memory after the first round.
  void note_left_behind(const std::string& name, const LeftBehind& left) const {
    constexpr double kMaxGrowth = 1.1;
    const bool returned = left.last.files <= left.before.files &&
                          static_cast<double>(left.last.bytes) <= kMaxGrowth * static_cast<double>(left.first.bytes);
    run_.note(absl::StrFormat(
        "%s: open files %d before and %d after; memory %.1f MiB before, %.1f with them, %.1f after the first time and "
        "%.1f after the last: %s",
        name, left.before.files, left.last.files, mib(left.before.bytes), mib(left.most), mib(left.first.bytes),
        mib(left.last.bytes), returned ? "returned" : "MISSED"));
  }

  const ServingRun& run_;
  const BenchMesh& mesh_;
};

}  // namespace

bool wants_guests(const ServingRun& run) {
  const std::vector<size_t> readers = silent_readers(run);
  return run.wants(churn_name(run)) ||
         std::any_of(readers.begin(), readers.end(), [&](size_t count) { return run.wants(silent_name(count)); });
}

absl::Status run_guest_cases(const ServingRun& run, const BenchMesh& mesh) {
  const GuestCases cases(run, mesh);
  absl::Status status;
  for (const size_t readers : silent_readers(run))
    if (status.ok()) status = cases.silent(readers);
  if (status.ok()) status = cases.churn();
  return status;
}

}  // namespace locus::bench::serving
