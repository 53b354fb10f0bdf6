#include "client/cli/extras/demo/demo_load.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include "absl/strings/str_cat.h"
#include "core/base/mutex.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kRaysABatch = 256;
constexpr int kRegionsABatch = 64;
constexpr size_t kSamplesAKind = 32;

double milliseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// Holder of the first error that any of several threads reports. Thread-safe.
class FirstError {
 public:
  void report(const absl::Status& status) {
    const MutexLock lock(mutex_);
    status_.Update(status);
  }
  absl::Status status() {
    const MutexLock lock(mutex_);
    return status_;
  }

 private:
  Mutex mutex_;
  absl::Status status_ LOCUS_GUARDED_BY(mutex_);
};

// Sampler of batches from a run of unknown length. It stores every stride-th batch. When it has more than kSamplesAKind
// samples, it drops every second sample and doubles the stride, so that the samples stay evenly spread over the run.
class Sampler {
 public:
  explicit Sampler(std::vector<Sample>& samples) : samples_(samples) {}

  void offer(const v1::QueryBatch& batch, const v1::QueryResult& result) {
    if (offered_++ % stride_ != 0) return;
    samples_.push_back({batch, result});
    if (samples_.size() <= kSamplesAKind) return;
    for (size_t i = 0; 2 * i < samples_.size(); ++i) samples_[i] = std::move(samples_[2 * i]);
    samples_.resize((samples_.size() + 1) / 2);
    stride_ *= 2;
  }

 private:
  std::vector<Sample>& samples_;
  size_t offered_ = 0;
  size_t stride_ = 1;
};

// Sends query batches of the kinds `kinds` in rotation until `done` is set. Each batch is sent when the previous batch
// has been answered.
absl::Status ask(const client::Client& client, const DemoWorld& world, const LoadOptions& options,
                 const std::vector<DemoKind>& kinds, const std::atomic<bool>& done, LoadResult& result) {
  const std::unique_ptr<client::QueryStream> stream = client.query_stream(options.scene);
  DemoRandom random(options.seed * 1000 + static_cast<uint64_t>(kinds.front()));
  std::vector<Sampler> samplers;
  samplers.reserve(kinds.size());
  for (const DemoKind kind : kinds) samplers.emplace_back(result.queries[static_cast<size_t>(kind)].samples);
  while (!done.load()) {
    for (size_t k = 0; k < kinds.size(); ++k) {
      const bool rays = kinds[k] == DemoKind::kFirst || kinds[k] == DemoKind::kAny;
      const int count = rays ? kRaysABatch : kRegionsABatch;
      const v1::QueryBatch batch = demo_batch(kinds[k], world, random, count);
      const Clock::time_point start = Clock::now();
      ASSIGN_OR_RETURN(v1::QueryResult answer, stream->send(batch).get());
      LoadFigures& figures = result.queries[static_cast<size_t>(kinds[k])];
      figures.milliseconds.push_back(milliseconds_since(start));
      figures.items += static_cast<uint64_t>(count);
      figures.found += count_found(answer.blocks(0));
      samplers[k].offer(batch, answer);
    }
  }
  return stream->close();
}

absl::Status check_ack(const v1::UpdateAck& ack) {
  if (ack.refused() == 0) return absl::OkStatus();
  return absl::InternalError(absl::StrCat(ack.refused(), " moves of a tick were refused"));
}

// Sends one batch per tick, which moves every object, at a rate of options.ticks_a_second. Then waits for all acks.
absl::Status write(const client::Client& client, const DemoWorld& world, const LoadOptions& options,
                   LoadResult& result) {
  const std::unique_ptr<client::UpdateStream> stream = client.update_stream(options.scene);
  FirstError error;
  const Clock::time_point start = Clock::now();
  for (uint64_t tick = 1; tick <= options.ticks && error.status().ok(); ++tick) {
    const Clock::time_point sent = Clock::now();
    const absl::Status status = stream->send(world.moves(tick), [&, sent](absl::StatusOr<v1::UpdateAck> ack) {
      error.report(ack.ok() ? check_ack(*ack) : ack.status());
      if (!ack.ok()) return;
      result.moves.milliseconds.push_back(milliseconds_since(sent));
      result.moves.items += ack->applied();
      result.last_revision = ack->revision();
      if (result.first_revision == 0) result.first_revision = ack->revision();
    });
    error.report(status);
    if (options.on_tick) options.on_tick(tick);
    std::this_thread::sleep_until(start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(
                                              static_cast<double>(tick) / options.ticks_a_second)));
  }
  error.report(stream->close());
  result.last_tick = options.ticks;
  result.seconds = milliseconds_since(start) / 1000;
  return error.status();
}

}  // namespace

double LoadFigures::percentile(double fraction) const {
  if (milliseconds.empty()) return 0;
  std::vector<double> sorted = milliseconds;
  std::sort(sorted.begin(), sorted.end());
  return sorted[std::min(sorted.size() - 1, static_cast<size_t>(fraction * static_cast<double>(sorted.size())))];
}

absl::StatusOr<LoadResult> run_load(const client::Client& client, const DemoWorld& world, const LoadOptions& options) {
  LoadResult result;
  FirstError error;
  std::atomic<bool> done = false;
  const auto asking = [&](const std::vector<DemoKind>& kinds) {
    return std::thread([&, kinds] { error.report(ask(client, world, options, kinds, done, result)); });
  };
  std::thread rays = asking({DemoKind::kFirst, DemoKind::kAny});
  std::thread regions = asking({DemoKind::kBalls, DemoKind::kBoxes});
  error.report(write(client, world, options, result));
  done.store(true);
  rays.join();
  regions.join();
  RETURN_IF_ERROR(error.status());
  return result;
}

}  // namespace locus::cli
