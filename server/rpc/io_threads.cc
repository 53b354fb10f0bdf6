#include "server/rpc/io_threads.h"

#include <grpc/support/time.h>

#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "server/scheduling/semaphore.h"
#include "server/scheduling/thread_priority.h"

namespace locus::server {
namespace {

using std::chrono::steady_clock;
using std::chrono::system_clock;

constexpr uint32_t kMaxThreads = 16;
// Interval between two checks for stalled calls.
constexpr std::chrono::seconds kStallCheck{1};

}  // namespace

// Thread that sets the alarm of a loop on request. The alarm is an event, so the wait on the loop's completion queue
// returns.
class IoWaker {
 public:
  void watch(IoLoop& loop) { loops_.push_back(&loop); }
  void start() {
    thread_ = std::thread([this] { run(); });
  }
  // Makes the thread set the alarms of all loops that have called interrupt(). Safe to call from any thread; takes no
  // lock.
  void wake() { calls_.post(); }
  // Ends the thread. No alarm is set afterwards.
  void stop() {
    over_.store(true);
    wake();
    thread_.join();
  }

 private:
  void run() {
    while (!over_.load()) {
      calls_.wait();
      for (IoLoop* loop : loops_) set_alarm(*loop);
    }
  }

  // Sets the loop's alarm if the loop wants to be woken and no alarm is pending. A pending alarm is enough, because the
  // thread that receives it also handles tags that were posted after the alarm was set.
  static void set_alarm(IoLoop& loop) {
    if (!loop.wanted_.exchange(false) || loop.alarm_set_.exchange(true)) return;
    loop.alarm_.Set(loop.queue_.get(), gpr_inf_past(GPR_CLOCK_MONOTONIC), &loop.woken_);
  }

  std::vector<IoLoop*> loops_;
  Semaphore calls_;
  std::atomic<bool> over_{false};
  std::thread thread_;
};

IoLoop::IoLoop(std::unique_ptr<grpc::ServerCompletionQueue> queue, IoWaker& waker)
    : EventLoop(static_cast<EventSource&>(*this)), queue_(std::move(queue)), waker_(waker) {}

EventSource::Next IoLoop::next(std::chrono::steady_clock::duration wait, EventTag** tag, bool* ok) {
  void* received = nullptr;
  // gRPC rounds deadlines up to whole milliseconds. So without a wait, the deadline must be in the past.
  const gpr_timespec deadline =
      wait <= wait.zero() ? gpr_inf_past(GPR_CLOCK_REALTIME) : grpc::TimePoint(system_clock::now() + wait).raw_time();
  switch (queue_->AsyncNext(&received, ok, deadline)) {
    case grpc::CompletionQueue::SHUTDOWN:
      return Next::kEnd;
    case grpc::CompletionQueue::TIMEOUT:
      return Next::kNothing;
    case grpc::CompletionQueue::GOT_EVENT:
      break;
  }
  *tag = static_cast<EventTag*>(received);
  return Next::kEvent;
}

void IoLoop::interrupt() {
  wanted_.store(true);
  waker_.wake();
}

void IoLoop::woken(bool) { alarm_set_.store(false); }

IoLoop::ActiveCalls::iterator IoLoop::enter(ActiveCall& call) {
  if (!std::exchange(stall_timer_set_, true)) at(steady_clock::now() + kStallCheck, [this] { check_stalled_calls(); });
  return active_calls_.insert(active_calls_.end(), &call);
}

void IoLoop::leave(ActiveCalls::iterator call) {
  active_calls_.erase(call);
  release();
}

void IoLoop::release() {
  expected_or_active_.fetch_sub(1);
  expected_or_active_.notify_all();
}

void IoLoop::wait_until_empty(bool running) {
  for (uint32_t left = expected_or_active_.load(); left > 0; left = expected_or_active_.load())
    if (running)
      expected_or_active_.wait(left);
    else
      turn();
}

// Calls drain() of every active call. Advances the iterator first, because drain() may remove the call from the list.
void IoLoop::drain_active_calls(bool) {
  for (auto active_call = active_calls_.begin(); active_call != active_calls_.end();) (*active_call++)->drain();
}

void IoLoop::recheck_active_calls(bool) {
  recheck_posted_.store(false);
  for (auto active_call = active_calls_.begin(); active_call != active_calls_.end();) (*active_call++)->recheck();
}

// Calls end_if_stalled() of every active call. Sets the timer again if active calls remain. If the last call ends while
// the timer is set, the timer fires once more.
void IoLoop::check_stalled_calls() {
  const Time now = steady_clock::now();
  for (auto active_call = active_calls_.begin(); active_call != active_calls_.end();)
    (*active_call++)->end_if_stalled(now);
  stall_timer_set_ = !active_calls_.empty();
  if (stall_timer_set_) at(now + kStallCheck, [this] { check_stalled_calls(); });
}

uint32_t IoThreads::count_for(uint32_t cores) {
  if (cores <= 1) return 1;
  return std::clamp(cores / 2, 2u, kMaxThreads);
}

IoThreads::IoThreads(grpc::ServerBuilder& builder, uint32_t count)
    : count_(count), waker_(std::make_unique<IoWaker>()) {
  LOCUS_CHECK_LE(1u, count);
  for (uint32_t i = 0; i < std::max(1u, count / kThreadsOfALoop); ++i) {
    loops_.push_back(std::make_unique<IoLoop>(builder.AddCompletionQueue(), *waker_));
    waker_->watch(*loops_.back());
  }
  waker_->start();
}

IoThreads::~IoThreads() { stop(); }

void IoThreads::start() {
  for (uint32_t i = 0; i < count_; ++i)
    running_.emplace_back([&loop = *loops_[i % loops_.size()]] {
      take_short_slices();
      while (loop.turn()) {
      }
    });
}

void IoThreads::drain() {
  for (const auto& loop : loops_) loop->post(loop->drain_);
}

void IoThreads::recheck() {
  for (const auto& loop : loops_)
    if (!loop->recheck_posted_.exchange(true)) loop->post(loop->recheck_);
}

void IoThreads::stop() {
  if (std::exchange(stopped_, true)) return;
  for (const auto& loop : loops_) loop->wait_until_empty(!running_.empty());
  waker_->stop();
  for (const auto& loop : loops_) loop->queue_->Shutdown();
  for (std::thread& thread : running_) thread.join();
  // gRPC requires that completion queues are drained, even if no thread ever served them.
  for (const auto& loop : loops_)
    while (running_.empty() && loop->turn()) {
    }
}

}  // namespace locus::server
