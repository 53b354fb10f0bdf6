#include "server/scheduling/event_loop.h"

#include <algorithm>
#include <utility>

#include "core/base/check.h"

namespace locus::server {
namespace {

using std::chrono::steady_clock;

// Maximum time that the leader sleeps, even if no timer is set. Small enough that a source's clock conversions cannot
// overflow.
constexpr std::chrono::hours kLongest{1};

}  // namespace

void EventLoop::post(EventTag& tag) {
  EventTag* head = posted_.load();
  do tag.next_ = head;
  while (!posted_.compare_exchange_weak(head, &tag));
  // The tag may be destroyed from here on. Either this thread sees that the leader is asleep, or the leader sees the
  // tag before it falls asleep, so no wake-up is lost.
  if (asleep_.exchange(false)) source_.interrupt();
}

EventLoop::Timers::iterator EventLoop::at(Time time, std::function<void()> callback) {
  // Interrupt a sleeping leader: it may sleep past `time`.
  if (asleep_.exchange(false)) source_.interrupt();
  return timers_.emplace(time, std::move(callback));
}

bool EventLoop::turn() {
  const std::optional<steady_clock::duration> wait = acquire_lead();
  if (!wait) return false;
  EventTag* tag = nullptr;
  bool ok = false;
  const EventSource::Next result = next(*wait, &tag, &ok);
  const MutexLock lock(mutex_);
  LOCUS_DCHECK(led_ && !ended_);
  LOCUS_DCHECK(result != EventSource::Next::kEvent || tag != nullptr);
  if (result == EventSource::Next::kEnd) {
    end();
    return false;
  }
  if (result == EventSource::Next::kEvent) tag->arrived(ok);
  run_posted();
  run_timers();
  run_deferred();
  return true;
}

std::optional<steady_clock::duration> EventLoop::acquire_lead() {
  const MutexLock lock(mutex_);
  while (led_ && !ended_) {
    ++followers_;
    mutex_.unlock();
    lead_.wait();
    mutex_.lock();
  }
  if (ended_) return std::nullopt;
  LOCUS_DCHECK(!led_);
  led_ = true;
  asleep_.store(true);  // set before mutex_ is released, so that at() interrupts this thread from now on
  if (timers_.empty()) return kLongest;
  return std::clamp<steady_clock::duration>(timers_.begin()->first - steady_clock::now(), {}, kLongest);
}

void EventLoop::release_lead() {
  LOCUS_DCHECK(led_);
  led_ = false;
  if (followers_ == 0) return;
  --followers_;
  lead_.post();
}

void EventLoop::end() {
  ended_ = true;
  led_ = false;
  for (; followers_ > 0; --followers_) lead_.post();
}

EventSource::Next EventLoop::next(steady_clock::duration wait, EventTag** tag, bool* ok) {
  if (posted_.load() != nullptr) wait = {};
  const EventSource::Next result = source_.next(wait, tag, ok);
  asleep_.store(false);
  return result;
}

void EventLoop::run_posted() {
  EventTag* newest = posted_.exchange(nullptr);
  EventTag* oldest = nullptr;
  while (newest != nullptr) {
    EventTag* const older = newest->next_;
    newest->next_ = std::exchange(oldest, newest);
    newest = older;
  }
  while (oldest != nullptr) {
    EventTag& tag = *oldest;
    oldest = tag.next_;  // read before arrived(), which may post the tag again
    tag.arrived(true);
  }
}

void EventLoop::run_timers() {
  while (!timers_.empty() && timers_.begin()->first <= steady_clock::now()) {
    const std::function<void()> callback = std::move(timers_.begin()->second);
    timers_.erase(timers_.begin());
    callback();
  }
}

// Runs the deferred tasks. Hands the lead to another thread before the first long task. If there is no long task,
// releases the lead without waking a thread, because this thread acquires the lead again in its next turn.
void EventLoop::run_deferred() {
  bool leads = true;
  while (!deferred_.empty()) {
    const Deferred next = deferred_.front();
    deferred_.pop_front();
    if (leads && next.length == TaskLength::kLong) {
      release_lead();
      leads = false;
    }
    mutex_.unlock();
    next.work->run_deferred();
    mutex_.lock();
    next.work->on_deferred_done();
  }
  LOCUS_DCHECK(!leads || led_);
  if (leads) led_ = false;
}

}  // namespace locus::server
