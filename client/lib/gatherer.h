// Gatherer of small items from many callers into one batch. A batch is sent when it is full, or when its first item has
// waited for the maximum delay. Internal to the library: QueryBatcher and MoveBatcher use it.
//
// Threads: add() and flush() may be called from any thread; the gatherer calls `send` in a thread of its own, one batch
// after another, without a lock held, so `send` may block. While `send` blocks, add() blocks as soon as the next batch
// is full. Invariant: at any time at most one batch is being gathered and at most one batch is being sent.
#ifndef LOCUS_CLIENT_LIB_GATHERER_H_
#define LOCUS_CLIENT_LIB_GATHERER_H_

#include <algorithm>
#include <cassert>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

#include "absl/time/time.h"
#include "client/lib/options.h"

namespace locus::client {

template <class Batch>
class Gatherer {
 public:
  Gatherer(const GatherLimits& limits, std::function<void(Batch)> send)
      : max_items_(std::max<size_t>(1, limits.max_items)),
        max_delay_(absl::ToChronoNanoseconds(limits.max_delay)),
        send_(std::move(send)),
        thread_([this] { run(); }) {}

  // Sends the items that were added, and waits until `send` has returned for them.
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

  // Adds one item: waits while the batch is full, then calls add_to(batch) with the lock held. The callback `add_to`
  // must add exactly one item to the batch.
  template <class AddTo>
  void add(const AddTo& add_to) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return items_ < max_items_; });
    if (items_++ == 0) due_ = Clock::now() + max_delay_;
    add_to(batch_);
    assert(check_invariants());
    if (items_ == 1 || items_ == max_items_) changed_.notify_all();
  }

  // Sends the gathered items without further delay, and blocks until `send` has returned for all items that were added
  // before this call.
  void flush() {
    std::unique_lock lock(mutex_);
    const uint64_t target = sent_ + (sending_ ? 1 : 0) + (items_ > 0 ? 1 : 0);
    due_ = Clock::now();
    changed_.notify_all();
    changed_.wait(lock, [&] { return sent_ >= target; });
  }

 private:
  using Clock = std::chrono::steady_clock;

  // Returns whether the batch that is being gathered is within its limit. The caller holds the lock.
  bool check_invariants() const { return items_ <= max_items_; }

  bool is_due() const { return items_ == max_items_ || (items_ > 0 && (ending_ || Clock::now() >= due_)); }

  void run() {
    std::unique_lock lock(mutex_);
    while (true) {
      changed_.wait(lock, [this] { return items_ > 0 || ending_; });
      if (items_ == 0) return;
      while (!is_due()) {
        const Clock::time_point due = due_;  // a copy, since flush() may change due_ during the wait
        changed_.wait_until(lock, due);
      }
      Batch batch = std::exchange(batch_, Batch());
      items_ = 0;
      assert(!sending_ && check_invariants());
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
  size_t items_ = 0;       // number of items in batch_
  Clock::time_point due_;  // time at which batch_ is sent even if it is not full
  bool sending_ = false;
  uint64_t sent_ = 0;  // number of batches for which `send` has returned
  bool ending_ = false;

  std::thread thread_;  // declared last: the thread uses all members above
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_GATHERER_H_
