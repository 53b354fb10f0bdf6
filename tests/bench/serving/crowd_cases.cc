#include "tests/bench/serving/crowd_cases.h"

#include <algorithm>
#include <atomic>
#include <thread>
#include <utility>

#include "tests/bench/serving/ending_cases.h"
#include "tests/bench/serving/ray_batches.h"
#include "tests/bench/serving/unary_load.h"

namespace locus::bench::serving {
namespace {

constexpr size_t kSmall = 16, kLarge = 8192;
constexpr size_t kBulkWindow = 4;
constexpr size_t kCalls = 16;  // that the overloaded server admits
constexpr size_t kFlood = 10;  // times as many

class CrowdCases {
 public:
  CrowdCases(const ServingRun& run, const BenchMesh& mesh) : run_(run), mesh_(mesh) {}

  // One small batch after another, alone and beside another client's large ones, by turns.
  absl::Status mixed(TwinScene& scene) const {
    run_.progress("mixed_p99/16");
    Batches small = batches_of(scattered_rays(mesh_, 64 * kSmall), kSmall, scene.name());
    Batches large = batches_of(coherent_rays(mesh_, 16 * kLarge), kLarge, scene.name());
    ServerLoad bulk(scene.daemon(), large, 1, kBulkWindow);
    const std::unique_ptr<QueryStreamLoad> stream = open_query_stream(scene.daemon());
    const LocalLoad process(scene.here().latest(), small, 1);
    std::vector<double> idle[2], beside[2];
    absl::Status status;
    for (int round = 0; round <= run_.options.rounds; ++round) {
      const std::vector<double> alone = latencies(*stream, small, process.hashes(), status);
      std::atomic<bool> stop = false;
      std::thread other([&] {
        while (!stop) bulk.run(1);
      });
      sleep_seconds(0.05);
      const std::vector<double> crowded = latencies(*stream, small, process.hashes(), status);
      stop = true;
      other.join();
      status.Update(bulk.status());
      if (!status.ok()) return status;
      for (size_t i = 0; i < 2 && round > 0; ++i) {
        idle[i].push_back(1e6 * percentile(alone, kShares[i]));
        beside[i].push_back(1e6 * percentile(crowded, kShares[i]));
      }
    }
    const std::string hash = hash_of_number(process.hashes().front());
    add_cell(run_, cell_of("mixed_p50/16", "us/batch", hash), "idle", beside[0], idle[0], Better::kLess);
    add_cell(run_, cell_of("mixed_p99/16", "us/batch", hash), "idle", beside[1], idle[1], Better::kLess);
    constexpr double kBar = 1.0 / 3;
    judge(run_, kBar, " = 1/3");
    return status;
  }

  absl::Status overload() const {
    const std::string name = "overload/10x";
    if (!run_.wants(name)) return absl::OkStatus();
    run_.progress(name);
    const auto daemon = Daemon::start({absl::StrCat("--max-calls=", kCalls)});
    if (!daemon.ok()) return daemon.status();
    TwinScene scene(**daemon, "flood");
    absl::Status status = scene.create();
    status.Update(scene.place(mesh_));
    const Batches batches = batches_of(scattered_rays(mesh_, 16'384), 1024, scene.name());
    const double seconds = run_.options.quick ? 0.2 : 2;
    std::vector<double> peak, flooded, refusals;
    std::vector<int64_t> memory;
    for (int round = 0; status.ok() && round <= run_.options.rounds; ++round) {
      const Flood calm = run_unary_load(**daemon, batches, kCalls, seconds);
      const Flood flood = run_unary_load(**daemon, batches, kFlood * kCalls, seconds);
      status.Update(calm.failure);
      status.Update(flood.failure);
      memory.push_back((*daemon)->process().resident_bytes());
      if (round == 0) continue;
      peak.push_back(static_cast<double>(calm.answered) / seconds);
      flooded.push_back(static_cast<double>(flood.answered) / seconds);
      refusals.insert(refusals.end(), flood.refusals.begin(), flood.refusals.end());
    }
    if (!status.ok()) return status;
    add_cell(run_, cell_of(name, "calls/s", hash_of_number(batches.queries)), "peak", flooded, peak, Better::kMore);
    constexpr double kBar = 0.8;
    judge(run_, kBar);
    note_refusals(name, refusals, memory);
    return status;
  }

 private:
  static constexpr double kShares[] = {0.5, 0.99};

  std::vector<double> latencies(QueryStreamLoad& stream, Batches& batches, const std::vector<uint64_t>& expected,
                                absl::Status& status) const {
    std::vector<double> seconds;
    const size_t count = run_.options.quick ? 300 : 5000;
    size_t sent = 0, wrong = 0;
    const auto next = [&](uint64_t& number) -> v1::StreamQueriesRequest* {
      if (sent == count) return nullptr;
      number = sent++ % batches.messages.size();
      return &batches.messages[number];
    };
    const auto reply = [&](uint64_t number, const v1::StreamQueriesResponse& response, double took) {
      seconds.push_back(took);
      if (hash_of(response.result()) != expected[number]) ++wrong;
    };
    status.Update(stream.run(1, next, reply));
    if (wrong != 0) run_.disagree(absl::StrCat("mixed_p99/16: ", wrong, " batches have other answers over gRPC"));
    if (seconds.empty()) seconds.push_back(0);
    return seconds;
  }

  void note_refusals(const std::string& name, const std::vector<double>& refusals,
                     const std::vector<int64_t>& memory) const {
    constexpr double kMostSeconds = 0.005;
    if (refusals.empty()) {
      run_.note(absl::StrCat(name, ": nothing was refused"));
    } else {
      const double p99 = percentile(refusals, 0.99);
      run_.note(absl::StrFormat("%s: %d calls refused, p50 %.2f ms, p99 %.2f ms, to be shown 5: %s", name,
                                refusals.size(), 1e3 * median(refusals), 1e3 * p99,
                                p99 < kMostSeconds ? "shown" : "MISSED"));
    }
    run_.note(absl::StrFormat("%s: the server holds %.1f MiB after the first flood and %.1f MiB after the last", name,
                              static_cast<double>(memory.front()) / (1 << 20),
                              static_cast<double>(memory.back()) / (1 << 20)));
  }

  const ServingRun& run_;
  const BenchMesh& mesh_;
};

}  // namespace

absl::Status run_crowd_cases(const ServingRun& run) {
  const bool mixed = run.wants("mixed_p50/16") || run.wants("mixed_p99/16");
  if (!mixed && !run.wants("overload/10x") && !wants_ending(run)) return absl::OkStatus();
  const absl::StatusOr<BenchMesh> mesh = level_of(run);
  if (!mesh.ok()) return mesh.status();
  const CrowdCases cases(run, *mesh);
  absl::Status status;
  if (mixed) {
    const auto daemon = Daemon::start();
    if (!daemon.ok()) return daemon.status();
    TwinScene scene(**daemon, "mixed");
    status = scene.create();
    status.Update(scene.place(*mesh));
    if (status.ok()) status = cases.mixed(scene);
  }
  if (status.ok()) status = cases.overload();
  if (status.ok()) status = run_ending_cases(run);
  return status;
}

}  // namespace locus::bench::serving
