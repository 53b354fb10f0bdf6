#include "tests/bench/dynamic/arena.h"

#include <sys/resource.h>

#include <chrono>
#include <thread>

#include "server/scheduling/thread_priority.h"
#include "tests/bench/frame/race.h"

namespace locus::bench::dynamic {
namespace {

constexpr size_t kBatchesApart = 997;     // reader i begins with batch number i * kBatchesApart
constexpr size_t kBatchesToACount = 500;  // a reader counts all objects, untimed, once in this many batches

void sleep_for(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

// Returns how often the kernel has preempted this thread to run another one (involuntary context switches).
int64_t preemptions() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_nivcsw;
}

void spin(const std::atomic<bool>& stop) {
  while (!stop.load(std::memory_order_relaxed)) {
  }
}

}  // namespace

Arena::Arena(uint32_t count) : world_(Kind::kUniform, count), batches_(queries_of(world_)), writer_(world_) {
  ours_.load(world_.objects());
}

void Arena::write(const Window& window, Seen& seen) {
  const double start = wall_seconds(), start_computing = thread_seconds();
  double moved = 0;
  while (!stop_) {
    if (window.rate != kUnpaced) {
      const double early = start + moved / window.rate - wall_seconds();
      if (early > 0) sleep_for(early);
    }
    writer_.move(ours_, window.batch);
    moved += static_cast<double>(window.batch);
  }
  seen.moves_a_second = moved / (wall_seconds() - start);
  seen.moves_a_computed_second = moved / (thread_seconds() - start_computing);
}

void Arena::read(size_t first_batch, Seen& seen) const {
  for (size_t i = 0; !stop_; ++i) {
    const int64_t preempted_before = preemptions();
    const double start = wall_seconds();
    const SnapshotPtr snapshot = ours_.latest();
    batches_.ask(*snapshot, first_batch + i);
    const double seconds = wall_seconds() - start;
    if (preemptions() == preempted_before)
      seen.latencies.push_back(seconds);
    else
      ++seen.interrupted;
    if (i % kBatchesToACount == 0 && count_objects(*snapshot) != world_.count()) ++seen.wrong_counts;
  }
}

Seen Arena::run(const Window& window) {
  stop_ = false;
  Seen all;
  std::vector<Seen> seen(window.readers);
  std::vector<std::thread> threads;
  for (size_t i = 0; i < seen.size(); ++i) {
    threads.emplace_back([&, i] {
      if (window.stand == Readers::kBelow) server::take_batch_priority(server::BatchPriority::kNice);
      read(i * kBatchesApart, seen[i]);
    });
  }
  if (window.beside == Beside::kWriter) threads.emplace_back([&] { write(window, all); });
  if (window.beside == Beside::kSpinning) threads.emplace_back([&] { spin(stop_); });
  sleep_for(window.seconds);
  stop_ = true;
  for (std::thread& thread : threads) thread.join();
  for (const Seen& one : seen) {
    all.latencies.insert(all.latencies.end(), one.latencies.begin(), one.latencies.end());
    all.interrupted += one.interrupted;
    all.wrong_counts += one.wrong_counts;
  }
  return all;
}

}  // namespace locus::bench::dynamic
