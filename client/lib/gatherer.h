// Small things from many callers, gathered into one batch until it is full or its first thing has waited long enough.
// Internal to the library: the machinery under QueryBatcher and MoveBatcher.
//
// Threads: add() and flush() may be called from any thread; `send` is called by one thread of the gatherer's own, one
// batch after another, never with a lock held, so that it may block: then a full batch blocks add(). Invariant: at most
// one batch is gathered and one sent, whatever callers do.
#ifndef LOCUS_CLIENT_LIB_GATHERER_H_
#define LOCUS_CLIENT_LIB_GATHERER_H_

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

#include "absl/time/time.h"
#include "client/lib/gather_limits.h"

namespace locus::client {

template <class Batch>
class Gatherer {
 public:
  Gatherer(const GatherLimits& limits, std::function<void(Batch)> send)
      : max_items_(std::max<size_t>(1, limits.max_items)),
        max_delay_(absl::ToChronoNanoseconds(limits.max_delay)),
        send_(std::move(send)),
        thread_([this] { run(); }) {}

  // Sends what is left.
  ~Gatherer() {
    {
      std::lock_guard lock(mutex_);
      ending_ = true;
      changed_.notify_all();
    }
    thread_.join();
  }
  Gatherer(const Gatherer&) = delete;
  Gatherer& operator=(const Gatherer&) = delete;

  // add_to(batch) puts one thing in, with the lock held. Blocks while the batch is full.
  template <class AddTo>
  void add(const AddTo& add_to) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return items_ < max_items_; });
    if (items_++ == 0) due_ = Clock::now() + max_delay_;
    add_to(batch_);
    if (items_ == 1 || items_ == max_items_) changed_.notify_all();
  }

  // Blocks until `send` has returned for all that was added before.
  void flush() {
    std::unique_lock lock(mutex_);
    const uint64_t wanted = sent_ + (sending_ ? 1 : 0) + (items_ > 0 ? 1 : 0);
    due_ = Clock::now();
    changed_.notify_all();
    changed_.wait(lock, [&] { return sent_ >= wanted; });
  }

 private:
  using Clock = std::chrono::steady_clock;

  bool is_due() const { return items_ == max_items_ || (items_ > 0 && (ending_ || Clock::now() >= due_)); }

  void run() {
    std::unique_lock lock(mutex_);
    while (true) {
      changed_.wait(lock, [this] { return items_ > 0 || ending_; });
      if (items_ == 0) return;
      while (!is_due()) {
        const Clock::time_point due = due_;  // flush() changes it meanwhile
        changed_.wait_until(lock, due);
      }
      Batch batch = std::exchange(batch_, Batch());
      items_ = 0;
      sending_ = true;
      changed_.notify_all();
      lock.unlock();
      send_(std::move(batch));
      lock.lock();
      sending_ = false;
      ++sent_;
      changed_.notify_all();
    }
  }

  const size_t max_items_;
  const Clock::duration max_delay_;
  const std::function<void(Batch)> send_;

  std::mutex mutex_;
  std::condition_variable changed_;
  Batch batch_;
  size_t items_ = 0;  // in batch_
  Clock::time_point due_;
  bool sending_ = false;
  uint64_t sent_ = 0;  // batches that `send` has returned for
  bool ending_ = false;

  std::thread thread_;  // last: it uses everything above
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_GATHERER_H_
