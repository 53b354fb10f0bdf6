#include "tests/bench/serving/crowd_cases.h"

#include <algorithm>
#include <utility>

#include "tests/bench/serving/ending_cases.h"
#include "tests/bench/serving/good_client.h"
#include "tests/bench/serving/guest_cases.h"
#include "tests/bench/serving/guest_process.h"
#include "tests/bench/serving/ray_batches.h"
#include "tests/bench/serving/unary_load.h"

namespace locus::bench::serving {
namespace {

constexpr size_t kLarge = 8192;  // rays per batch of the other client
constexpr size_t kBulkWindow = 4;
constexpr double kUntilBusy = 0.2;  // seconds for the other client to connect
constexpr size_t kCalls = 16;       // calls that the overloaded server admits
constexpr size_t kFlood = 10;       // number of callers, as a multiple of the admitted calls
constexpr const char* kAtOnce = "overload/10x/at_once";
constexpr const char* kAsTold = "overload/10x/as_told";

class CrowdCases {
 public:
  CrowdCases(const ServingRun& run, const BenchMesh& mesh) : run_(run), mesh_(mesh) {}

  // Measures the time of small batches, sent one after another, in turns: alone, and while another client sends large
  // batches.
  absl::Status mixed(TwinScene& scene) const {
    run_.progress("mixed_p99/16");
    constexpr size_t kSmall = GoodClient::kRays;
    GoodClient good(run_, scene, "mixed_p99/16", batches_of(scattered_rays(mesh_, 64 * kSmall), kSmall, scene.name()));
    const GuestProgram bulk(scene.daemon(), "bulk", kBulkWindow, scene.name(),
                            batches_of(coherent_rays(mesh_, kLarge), kLarge, "").messages.front().batch());
    const size_t count = run_.options.quick ? 300 : 5000;
    std::vector<double> idle[2], beside[2];
    for (int round = 0; round <= run_.options.rounds; ++round) {
      std::vector<double> alone, crowded;
      good.ask(count, alone);
      const absl::StatusOr<std::unique_ptr<Process>> other = bulk.start();
      if (!other.ok()) return other.status();
      sleep_seconds(kUntilBusy);
      good.ask(count, crowded);
      if ((*other)->has_ended()) return absl::DataLossError("the other client was not served: " + bulk.log());
      if (!good.status().ok()) return good.status();
      for (size_t i = 0; i < 2 && round > 0; ++i) {
        idle[i].push_back(1e6 * percentile(alone, kShares[i]));
        beside[i].push_back(1e6 * percentile(crowded, kShares[i]));
      }
    }
    const std::string hash = hash_of_number(good.expected().front());
    add_cell(run_, cell_of("mixed_p50/16", "us/batch", hash), "idle", beside[0], idle[0], Better::kLess);
    add_cell(run_, cell_of("mixed_p99/16", "us/batch", hash), "idle", beside[1], idle[1], Better::kLess);
    constexpr double kBar = 1.0 / 3;
    note_bar(run_.report, kBar, " = 1/3");
    return absl::OkStatus();
  }

  // Measures the rate of answers with ten times as many callers as the server admits; `again` is the behaviour of a
  // refused caller.
  absl::Status overload(const std::string& name, Again again) const {
    if (!run_.wants(name)) return absl::OkStatus();
    run_.progress(name);
    const auto daemon = Daemon::start({absl::StrCat("--max-calls=", kCalls)});
    if (!daemon.ok()) return daemon.status();
    TwinScene scene(**daemon, "flood");
    absl::Status status = scene.create();
    status.Update(scene.place(mesh_));
    const Batches batches = batches_of(scattered_rays(mesh_, 16'384), 1024, scene.name());
    const double seconds = run_.options.quick ? 0.3 : 2;
    std::vector<double> peak, flooded;
    Crowd crowd;
    for (int round = 0; status.ok() && round <= run_.options.rounds; ++round) {
      const Flood calm = run_unary_load(**daemon, batches, kCalls, seconds, again);
      const Flood flood = run_unary_load(**daemon, batches, kFlood * kCalls, seconds, again);
      status.Update(calm.failure);
      status.Update(flood.failure);
      crowd.memory.push_back((*daemon)->process().resident_bytes());
      if (round == 0) continue;
      peak.push_back(static_cast<double>(calm.answered) / seconds);
      flooded.push_back(static_cast<double>(flood.answered) / seconds);
      crowd.add(calm, flood);
    }
    if (!status.ok()) return status;
    add_cell(run_, cell_of(name, "calls/s", hash_of_number(batches.queries)), "peak", flooded, peak, Better::kMore);
    constexpr double kBar = 0.8;
    note_bar(run_.report, kBar);
    note_refusals(name, crowd, seconds * run_.options.rounds);
    return status;
  }

 private:
  static constexpr double kShares[] = {0.5, 0.99};

  // Measurements of an overload case, summed or collected over its rounds. Each round has a calm phase, with as many
  // callers as the server admits, and then a flood, with too many callers.
  struct Crowd {
    std::vector<double> refusals;  // seconds until each refusal
    std::vector<int64_t> memory;   // resident bytes of the server after each flood
    size_t calm_answers = 0, answers = 0;
    double calm_client = 0, calm_server = 0, client = 0, server = 0;  // processor time in seconds

    void add(const Flood& calm, const Flood& flood) {
      refusals.insert(refusals.end(), flood.refusals.begin(), flood.refusals.end());
      calm_answers += calm.answered;
      answers += flood.answered;
      calm_client += calm.client_seconds;
      calm_server += calm.server_seconds;
      client += flood.client_seconds;
      server += flood.server_seconds;
    }
    // Returns microseconds of processor time per refusal. Subtracts from the floods' `seconds` the time of the answers,
    // assuming that an answer takes as long as in the calm phases.
    double each(double seconds, double calm_seconds) const {
      const double answering = calm_seconds * static_cast<double>(answers) / static_cast<double>(calm_answers);
      return 1e6 * (seconds - answering) / static_cast<double>(refusals.size());
    }
  };

  void note_refusals(const std::string& name, const Crowd& crowd, double seconds) const {
    constexpr double kMaxSeconds = 0.005;
    if (crowd.refusals.empty() || crowd.calm_answers == 0) {
      run_.note(absl::StrCat(name, ": nothing was refused"));
    } else {
      const double p99 = percentile(crowd.refusals, 0.99);
      run_.note(absl::StrFormat("%s: %d calls refused, p50 %.2f ms, p99 %.2f ms, required 5: %s", name,
                                crowd.refusals.size(), 1e3 * median(crowd.refusals), 1e3 * p99,
                                p99 < kMaxSeconds ? "shown" : "MISSED"));
      run_.note(absl::StrFormat(
          "%s: processor time a refusal: client %.1f us, server %.1f us; together they computed "
          "on %.2f cores, in the calm on %.2f",
          name, crowd.each(crowd.client, crowd.calm_client), crowd.each(crowd.server, crowd.calm_server),
          (crowd.client + crowd.server) / seconds, (crowd.calm_client + crowd.calm_server) / seconds));
    }
    run_.note(absl::StrFormat("%s: the server holds %.1f MiB after the first flood and %.1f MiB after the last", name,
                              static_cast<double>(crowd.memory.front()) / (1 << 20),
                              static_cast<double>(crowd.memory.back()) / (1 << 20)));
  }

  const ServingRun& run_;
  const BenchMesh& mesh_;
};

}  // namespace

absl::Status run_crowd_cases(const ServingRun& run) {
  const bool mixed = run.wants("mixed_p50/16") || run.wants("mixed_p99/16");
  const bool overload = run.wants(kAtOnce) || run.wants(kAsTold);
  if (!mixed && !overload && !wants_guests(run) && !wants_ending(run)) return absl::OkStatus();
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
  if (status.ok()) status = cases.overload(kAsTold, Again::kAsTold);
  if (status.ok()) status = cases.overload(kAtOnce, Again::kAtOnce);
  if (status.ok() && wants_guests(run)) status = run_guest_cases(run, *mesh);
  if (status.ok()) status = run_ending_cases(run);
  return status;
}

}  // namespace locus::bench::serving
