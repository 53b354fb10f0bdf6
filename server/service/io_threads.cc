#include "server/service/io_threads.h"

#include <grpc/support/time.h>

#include <algorithm>
#include <utility>

#include "core/base/check.h"

namespace locus::server {
namespace {

using std::chrono::steady_clock;
using std::chrono::system_clock;

constexpr uint32_t kMostThreads = 16;
// Sleeping for longer than any timer asks: gRPC's clock conversions stay far from their ends.
constexpr std::chrono::hours kLongest{1};

}  // namespace

class IoWaker {
 public:
  void watch(IoThread& thread) { threads_.push_back(&thread); }
  void start() {
    thread_ = std::thread([this] { run(); });
  }
  // From any thread.
  void wake() {
    calls_.fetch_add(1);
    calls_.notify_one();
  }
  // Afterwards no alarm is set any more.
  void stop() {
    over_.store(true);
    wake();
    thread_.join();
  }

 private:
  void run() {
    uint32_t seen = 0;
    while (!over_.load()) {
      calls_.wait(seen);
      seen = calls_.load();
      for (IoThread* thread : threads_) tell(*thread);
    }
  }

  // An alarm on its way is enough: whoever gets it looks for what was posted afterwards.
  static void tell(IoThread& thread) {
    if (thread.posted_.load() == nullptr || thread.alarm_set_.exchange(true)) return;
    thread.alarm_.Set(thread.queue_.get(), gpr_inf_past(GPR_CLOCK_MONOTONIC), &thread.woken_);
  }

  std::vector<IoThread*> threads_;
  std::atomic<uint32_t> calls_{0};
  std::atomic<bool> over_{false};
  std::thread thread_;
};

IoThread::IoThread(std::unique_ptr<grpc::ServerCompletionQueue> queue, IoWaker& waker)
    : queue_(std::move(queue)), waker_(waker) {}

void IoThread::post(IoTag& tag) {
  IoTag* head = posted_.load();
  do tag.next_ = head;
  while (!posted_.compare_exchange_weak(head, &tag));
  // From here on the tag may be gone. Either this sees that the thread is asleep, or the thread sees the tag before it
  // falls asleep.
  if (asleep_.exchange(false)) waker_.wake();
}

void IoThread::woken(bool) { alarm_set_.store(false); }

IoThread::Residents::iterator IoThread::enter(Resident& call) {
  return residents_.insert(residents_.end(), &call);
}

void IoThread::leave(Residents::iterator call) {
  residents_.erase(call);
  forgo();
}

void IoThread::forgo() {
  expected_or_resident_.fetch_sub(1);
  expected_or_resident_.notify_all();
}

void IoThread::wait_until_empty(bool running) {
  for (uint32_t left = expected_or_resident_.load(); left > 0; left = expected_or_resident_.load())
    if (running)
      expected_or_resident_.wait(left);
    else
      turn();
}

// Residents may leave while they are told.
void IoThread::drain_residents(bool) {
  for (auto resident = residents_.begin(); resident != residents_.end();) (*resident++)->drain();
}

void IoThread::run_posted() {
  IoTag* newest = posted_.exchange(nullptr);
  IoTag* oldest = nullptr;
  while (newest != nullptr) {
    IoTag* const older = newest->next_;
    newest->next_ = std::exchange(oldest, newest);
    newest = older;
  }
  while (oldest != nullptr) {
    IoTag& tag = *oldest;
    oldest = tag.next_;  // before it arrives, which may post it again
    tag.arrived(true);
  }
}

void IoThread::run_timers() {
  while (!timers_.empty() && timers_.begin()->first <= steady_clock::now()) {
    const std::function<void()> then = std::move(timers_.begin()->second);
    timers_.erase(timers_.begin());
    then();
  }
}

grpc::CompletionQueue::NextStatus IoThread::next(void** tag, bool* ok) {
  const steady_clock::time_point now = steady_clock::now();
  steady_clock::duration wait = kLongest;
  if (!timers_.empty()) wait = std::clamp<steady_clock::duration>(timers_.begin()->first - now, {}, kLongest);
  asleep_.store(true);
  if (posted_.load() != nullptr) wait = {};
  const auto status = queue_->AsyncNext(tag, ok, system_clock::now() + wait);
  asleep_.store(false);
  return status;
}

bool IoThread::turn() {
  void* tag = nullptr;
  bool ok = false;
  const grpc::CompletionQueue::NextStatus status = next(&tag, &ok);
  if (status == grpc::CompletionQueue::SHUTDOWN) return false;
  if (status == grpc::CompletionQueue::GOT_EVENT) static_cast<IoTag*>(tag)->arrived(ok);
  run_posted();
  run_timers();
  return true;
}

uint32_t IoThreads::count_for(uint32_t cores) {
  if (cores <= 1) return 1;
  return std::clamp(cores / 2, 2u, kMostThreads);
}

IoThreads::IoThreads(grpc::ServerBuilder& builder, uint32_t count) : waker_(std::make_unique<IoWaker>()) {
  LOCUS_CHECK_LE(1u, count);
  for (uint32_t i = 0; i < count; ++i) {
    threads_.push_back(std::make_unique<IoThread>(builder.AddCompletionQueue(), *waker_));
    waker_->watch(*threads_.back());
  }
  waker_->start();
}

IoThreads::~IoThreads() { stop(); }

void IoThreads::start() {
  for (const auto& thread : threads_)
    running_.emplace_back([&thread = *thread] {
      while (thread.turn()) {
      }
    });
}

void IoThreads::drain() {
  for (const auto& thread : threads_) thread->post(thread->drain_);
}

void IoThreads::stop() {
  if (std::exchange(stopped_, true)) return;
  for (const auto& thread : threads_) thread->wait_until_empty(!running_.empty());
  waker_->stop();
  for (const auto& thread : threads_) thread->queue_->Shutdown();
  for (std::thread& thread : running_) thread.join();
  // Queues that nobody served are emptied all the same, as gRPC asks.
  for (const auto& thread : threads_)
    while (running_.empty() && thread->turn()) {
    }
}

}  // namespace locus::server
