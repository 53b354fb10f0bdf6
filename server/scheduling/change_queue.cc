#include "server/scheduling/change_queue.h"

#include <utility>

#include "core/base/check.h"
#include "core/base/refusal.h"

namespace locus::server {
namespace {

constexpr uint32_t kRetryAfterMs = 1000;

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
  Line& line = lines_[key];
  const size_t pending = line.waiting.size() + (line.running ? 1 : 0);
  if (pending >= max_waiting_)
    return refuse_full("", "pending_changes", max_waiting_, static_cast<double>(pending + 1), kRetryAfterMs);
  if (!line.running && line.waiting.empty()) {
    ready_.push_back(key);
    work_.notify_one();
  }
  line.waiting.push_back(std::move(job));
  return ++line.last_number;
}

uint32_t ChangeQueue::pending(uint64_t key) const {
  MutexLock lock(mutex_);
  const auto line = lines_.find(key);
  if (line == lines_.end()) return 0;
  return static_cast<uint32_t>(line->second.waiting.size()) + (line->second.running ? 1 : 0);
}

void ChangeQueue::forget(uint64_t key) {
  MutexLock lock(mutex_);
  const auto line = lines_.find(key);
  if (line == lines_.end()) return;
  line->second.forgotten = true;
  if (!line->second.running && line->second.waiting.empty()) lines_.erase(line);
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
      Line& line = lines_[key];
      number = line.last_number - line.waiting.size() + 1;
      job = std::move(line.waiting.front());
      line.waiting.pop_front();
      line.running = true;
    }
    job(number);
    job = nullptr;
    finish(key);
  }
}

void ChangeQueue::finish(uint64_t key) {
  MutexLock lock(mutex_);
  const auto line = lines_.find(key);
  line->second.running = false;
  if (!line->second.waiting.empty()) {
    ready_.push_back(key);
    work_.notify_one();
  } else if (line->second.forgotten) {
    lines_.erase(line);
  }
}

}  // namespace locus::server
