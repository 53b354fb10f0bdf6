#include "server/scheduling/event_loop.h"

#include <algorithm>
#include <utility>

namespace locus::server {
namespace {

using std::chrono::steady_clock;

// Sleeping for longer than any timer asks: a source's clock conversions stay far from their ends.
constexpr std::chrono::hours kLongest{1};

}  // namespace

void EventLoop::post(EventTag& tag) {
  EventTag* head = posted_.load();
  do tag.next_ = head;
  while (!posted_.compare_exchange_weak(head, &tag));
  // From here on the tag may be gone. Either this sees that the leader is asleep, or a leader sees the tag before it
  // falls asleep.
  if (asleep_.exchange(false)) source_.interrupt();
}

EventLoop::Timers::iterator EventLoop::at(Time time, std::function<void()> then) {
  // The leader may be another thread, and asleep for too long.
  if (asleep_.exchange(false)) source_.interrupt();
  return timers_.emplace(time, std::move(then));
}

bool EventLoop::turn() {
  const std::optional<steady_clock::duration> wait = take_lead();
  if (!wait) return false;
  EventTag* tag = nullptr;
  bool ok = false;
  const EventSource::Next what = next(*wait, &tag, &ok);
  const MutexLock lock(mutex_);
  if (what == EventSource::Next::kEnd) {
    end();
    return false;
  }
  if (what == EventSource::Next::kEvent) tag->arrived(ok);
  run_posted();
  run_timers();
  run_deferred();
  return true;
}

std::optional<steady_clock::duration> EventLoop::take_lead() {
  const MutexLock lock(mutex_);
  while (led_ && !ended_) {
    ++followers_;
    mutex_.unlock();
    lead_.wait();
    mutex_.lock();
  }
  if (ended_) return std::nullopt;
  led_ = true;
  asleep_.store(true);  // before the lock is left: a timer that is set from now on interrupts
  if (timers_.empty()) return kLongest;
  return std::clamp<steady_clock::duration>(timers_.begin()->first - steady_clock::now(), {}, kLongest);
}

void EventLoop::leave_lead() {
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
  const EventSource::Next what = source_.next(wait, tag, ok);
  asleep_.store(false);
  return what;
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
    oldest = tag.next_;  // before it arrives, which may post it again
    tag.arrived(true);
  }
}

void EventLoop::run_timers() {
  while (!timers_.empty() && timers_.begin()->first <= steady_clock::now()) {
    const std::function<void()> then = std::move(timers_.begin()->second);
    timers_.erase(timers_.begin());
    then();
  }
}

// Without work, or with short work only, the lead is just laid down: whoever is up takes it, and that is this thread,
// in its next turn.
void EventLoop::run_deferred() {
  bool leads = true;
  while (!deferred_.empty()) {
    const Deferred next = deferred_.front();
    deferred_.pop_front();
    if (leads && next.length == TaskLength::kLong) {
      leave_lead();
      leads = false;
    }
    mutex_.unlock();
    next.work->run_deferred();
    mutex_.lock();
    next.work->on_deferred_done();
  }
  if (leads) led_ = false;
}

}  // namespace locus::server
