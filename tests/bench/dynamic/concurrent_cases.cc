#include "tests/bench/dynamic/concurrent_cases.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "tests/bench/dynamic/arena.h"
#include "tests/bench/dynamic/world_run.h"
#include "tests/bench/frame/race.h"
#include "tests/bench/frame/results_hash.h"
#include "tests/bench/frame/statistics.h"

namespace locus::bench::dynamic {
namespace {

constexpr double kPace = 1e6;  // moves per second

struct Share {
  const char* name;
  double share;
};
constexpr Share kShares[] = {{"concurrent_p50", 0.5}, {"concurrent_p99", 0.99}, {"concurrent_p999", 0.999}};

class Rounds {
 public:
  Rounds(const Options& options, const Progress& progress, uint32_t count, Report& report)
      : options_(options), progress_(progress), count_(count), report_(report) {}

  void run() {
    if (wants_latencies()) run_latencies();
    run_kept_pace("concurrent_moves/3readers", Readers::kEqual);
    run_kept_pace("concurrent_moves/3readers_below", Readers::kBelow);
    for (const size_t batch : {100, 1000, 10'000})
      if (options_.filter.wants(unpaced_name(batch))) run_unpaced(batch);
  }

 private:
  std::string name_of_case(const std::string& what) const { return absl::StrCat(what, "/", name_of_count(count_)); }
  std::string unpaced_name(size_t batch) const {
    const std::string name = name_of_case("unpaced/1reader");
    return batch == 1000 ? name : absl::StrCat(name, "/batch", batch);
  }
  bool wants_latencies() const {
    for (const Share& share : kShares)
      if (options_.filter.wants(name_of_case(absl::StrCat(share.name, "/1reader")))) return true;
    return false;
  }

  // Runs `window` for 2 s, or 0.05 s in a quick run. Makes the world at the first call and not earlier, since not every
  // case needs it.
  Seen run(const Window& window) {
    if (arena_ == nullptr) arena_ = std::make_unique<Arena>(count_);
    Window timed = window;
    timed.seconds = options_.quick ? 0.05 : 2;
    Seen seen = arena_->run(timed);
    // If no batch was completed in the window, a latency is only known to be at least the window's length.
    if (timed.readers != 0 && seen.latencies.empty()) seen.latencies.push_back(timed.seconds);
    if (timed.readers == 1) {
      batches_ += seen.latencies.size();
      interrupted_ += seen.interrupted;
    }
    if (seen.wrong_counts != 0)
      report_.disagreements.push_back(absl::StrCat(name_of_case("concurrent"), ": ", seen.wrong_counts,
                                                   " revisions did not hold all objects once"));
    return seen;
  }

  // Measures one reader in three situations, in turns: alone, while a thread only spins, and while the writer runs.
  void run_latencies() {
    progress_(name_of_case("concurrent_p99/1reader"));
    const Window windows[] = {
        {1, 1, Beside::kWriter, 1000, kPace}, {1, 1, Beside::kNothing}, {1, 1, Beside::kSpinning}};
    run(windows[1]);
    std::vector<std::vector<double>> times[std::size(kShares)];
    for (auto& rows : times) rows.resize(std::size(windows));
    for (int round = 0; round < options_.rounds; ++round) {
      for (size_t i = 0; i < std::size(windows); ++i) {
        const Seen seen = run(windows[i]);
        for (size_t k = 0; k < std::size(kShares); ++k)
          times[k][i].push_back(1e6 * percentile(seen.latencies, kShares[k].share));
      }
    }
    const std::vector<Contestant> contestants = {
        {"locus", {}, 1, {}}, {"no_writer", {}, 1, {}}, {"spinning", {}, 1, {}}};
    for (size_t k = 0; k < std::size(kShares); ++k) {
      const std::string name = name_of_case(absl::StrCat(kShares[k].name, "/1reader"));
      if (options_.filter.wants(name)) add_cells(contestants, times[k], cell(name, "us/batch"), report_);
    }
    report_.notes.push_back(absl::StrCat(name_of_case("concurrent_p99/1reader"), ": ", interrupted_, " batches beside ",
                                         batches_, " lost their core to other programs and are left out"));
  }

  void run_kept_pace(const std::string& what, Readers stand) {
    const std::string name = name_of_case(what);
    if (!options_.filter.wants(name)) return;
    progress_(name);
    std::vector<double> rates;
    for (int round = 0; round < options_.rounds; ++round)
      rates.push_back(run({1, 3, Beside::kWriter, 1000, kPace, stand}).moves_a_second);
    add_rates(name, rates, "paced", std::vector<double>(rates.size(), kPace));
  }

  void run_unpaced(size_t batch) {
    const std::string name = unpaced_name(batch);
    progress_(name);
    std::vector<double> rates, computed, alone;
    for (int round = 0; round < options_.rounds; ++round) {
      const Seen seen = run({1, 1, Beside::kWriter, batch, kUnpaced});
      rates.push_back(seen.moves_a_second);
      computed.push_back(seen.moves_a_computed_second);
      alone.push_back(run({1, 0, Beside::kWriter, batch, kUnpaced}).moves_a_second);
    }
    add_rates(name, rates, "no_reader", alone);
    report_.notes.push_back(
        absl::StrFormat("%s: %.3g M moves in a second of the writer's own computing", name, 1e-6 * median(computed)));
  }

  void add_rates(const std::string& name, const std::vector<double>& ours, const std::string& peer_name,
                 const std::vector<double>& peer) {
    const std::vector<double> ratios = round_ratios(peer, ours);
    Cell full = cell(name, "M moves/s");
    full.ours = 1e-6 * median(ours);
    full.peer = 1e-6 * median(peer);
    full.peer_name = peer_name;
    full.ratio = median(ratios);
    full.spread = spread(ratios);
    report_.add(full);
  }

  Cell cell(const std::string& name, const std::string& metric) const {
    return cell_of(name, metric, hash_of_number(count_));
  }

  const Options& options_;
  const Progress& progress_;
  const uint32_t count_;
  Report& report_;
  std::unique_ptr<Arena> arena_;
  size_t batches_ = 0, interrupted_ = 0;  // numbers of timed and of interrupted batches in windows with one reader
};

}  // namespace

void run_concurrent_cases(const Options& options, const Progress& progress, Report& report) {
  const std::vector<uint32_t> counts =
      options.quick ? std::vector<uint32_t>{10'000} : std::vector<uint32_t>{100'000, 1'000'000};
  for (const uint32_t count : counts) Rounds(options, progress, count, report).run();
}

}  // namespace locus::bench::dynamic
