#include "server/scheduling/change_queue.h"

#include <utility>

#include "core/base/check.h"
#include "core/base/refusal.h"

namespace locus::server {
namespace {

constexpr uint32_t kFullChangesRetryMs = 1000;

}  // namespace

ChangeQueue::ChangeQueue(uint32_t threads, uint32_t max_waiting) : max_waiting_(max_waiting) {
  LOCUS_CHECK_LE(1u, threads);
  for (uint32_t i = 0; i < threads; ++i) threads_.emplace_back([this] { run(); });
}

ChangeQueue::~ChangeQueue() {
  {
    MutexLock lock(mutex_);
    ended_ = true;
    work_.notify_all();
  }
  for (std::thread& thread : threads_) thread.join();
}

absl::StatusOr<uint64_t> ChangeQueue::submit(uint64_t key, Job job) {
  MutexLock lock(mutex_);
  KeyQueue& queue = queues_[key];
  const size_t pending = queue.waiting.size() + (queue.running ? 1 : 0);
  if (pending >= max_waiting_)
    return refuse_full("", "pending_changes", max_waiting_, static_cast<double>(pending + 1), kFullChangesRetryMs);
  if (!queue.running && queue.waiting.empty()) {
    ready_.push_back(key);
    work_.notify_one();
  }
  queue.waiting.push_back(std::move(job));
  ++queue.last_number;
  LOCUS_DCHECK_CALL(check_invariants(key));
  return queue.last_number;
}

uint32_t ChangeQueue::pending(uint64_t key) const {
  MutexLock lock(mutex_);
  const auto queue = queues_.find(key);
  if (queue == queues_.end()) return 0;
  return static_cast<uint32_t>(queue->second.waiting.size()) + (queue->second.running ? 1 : 0);
}

void ChangeQueue::forget(uint64_t key) {
  MutexLock lock(mutex_);
  const auto queue = queues_.find(key);
  if (queue == queues_.end()) return;
  queue->second.forgotten = true;
  if (!queue->second.running && queue->second.waiting.empty()) queues_.erase(queue);
}

void ChangeQueue::run() {
  while (true) {
    uint64_t key = 0;
    uint64_t number = 0;
    Job job;
    {
      MutexLock lock(mutex_);
      while (ready_.empty() && !ended_) work_.wait(mutex_);
      if (ended_) return;
      key = ready_.front();
      ready_.pop_front();
      KeyQueue& queue = queues_[key];
      LOCUS_DCHECK(!queue.running && !queue.waiting.empty());
      number = queue.last_number - queue.waiting.size() + 1;
      job = std::move(queue.waiting.front());
      queue.waiting.pop_front();
      queue.running = true;
      LOCUS_DCHECK_CALL(check_invariants(key));
    }
    job(number);
    job = nullptr;
    finish(key);
  }
}

void ChangeQueue::finish(uint64_t key) {
  MutexLock lock(mutex_);
  const auto queue = queues_.find(key);
  LOCUS_DCHECK(queue != queues_.end() && queue->second.running);
  queue->second.running = false;
  if (!queue->second.waiting.empty()) {
    ready_.push_back(key);
    work_.notify_one();
  } else if (queue->second.forgotten) {
    queues_.erase(queue);
  }
  LOCUS_DCHECK_CALL(check_invariants(key));
}

void ChangeQueue::check_invariants(uint64_t key) const {
  LOCUS_CHECK_LE(ready_.size(), queues_.size());
  const auto found = queues_.find(key);
  if (found == queues_.end()) return;
  const KeyQueue& queue = found->second;
  LOCUS_CHECK_LE(queue.waiting.size() + (queue.running ? 1 : 0), max_waiting_);
  LOCUS_CHECK_LE(queue.waiting.size() + (queue.running ? 1 : 0), queue.last_number);
}

}  // namespace locus::server
