// Event loop run by a few threads. One thread at a time, the leader, waits for the next event and runs its handler. A
// leader with short handlers stays the leader, so a stream of short events causes no thread switch. Before a long
// deferred task, the leader makes another thread the leader (hands over the lead), so that every thread can run a long
// task at the same time. Method: D. C. Schmidt, C. O'Ryan, I. Pyarali, M. Kircher and F. Buschmann, Leader/Followers
// (2000).
//
// Handlers of events and timers and on_deferred_done() run under the lock of the loop, so the objects they share need
// no lock of their own. Deferred tasks run without the lock.
//
// Threads: post() may be called from any thread. post() takes no lock, so no thread waits for a thread of low priority
// that was preempted in post(). All other members except turn() may be called only by handlers, or before the first
// turn(). Lifetime: a tag's arrived() may be called while the posting thread is still in post(), so all calls of post()
// must have returned before the loop is destroyed. Invariant: at most one thread leads.
#ifndef LOCUS_SERVER_SCHEDULING_EVENT_LOOP_H_
#define LOCUS_SERVER_SCHEDULING_EVENT_LOOP_H_

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>

#include "core/base/mutex.h"
#include "server/scheduling/semaphore.h"

namespace locus::server {

// Handler of an event. post() or the event source passes the tag to the loop, which calls arrived(). The tag must not
// be destroyed before arrived() is called.
class EventTag {
 public:
  virtual ~EventTag() = default;
  // Handles the event. `ok` is the result that EventSource::next() returned for the event; true for a posted tag.
  virtual void arrived(bool ok) = 0;

 private:
  friend class EventLoop;
  EventTag* next_ = nullptr;  // next tag in the list of posted tags
};

// An EventTag that calls a member function of its owner.
template <class Owner>
class MemberTag final : public EventTag {
 public:
  MemberTag(Owner& owner, void (Owner::*member)(bool)) : owner_(owner), member_(member) {}
  void arrived(bool ok) override { (owner_.*member_)(ok); }

 private:
  Owner& owner_;
  void (Owner::*member_)(bool);
};

// Source of events, such as a completion queue.
class EventSource {
 public:
  enum class Next : uint8_t { kEvent, kNothing, kEnd };

  virtual ~EventSource() = default;
  // Waits at most `wait` for an event. Returns kEvent and sets `*tag` and `*ok` to the event's handler and result,
  // kNothing if no event arrived, or kEnd once there will be no more events. Called by one thread at a time.
  virtual Next next(std::chrono::steady_clock::duration wait, EventTag** tag, bool* ok) = 0;
  // Makes a waiting next() return soon. Any thread may call interrupt(), which takes no lock.
  virtual void interrupt() = 0;
};

// Task that a handler defers: a thread of the loop runs it without the lock.
class DeferredTask {
 public:
  virtual ~DeferredTask() = default;
  virtual void run_deferred() = 0;
  // Handles the end of run_deferred(); called under the lock. The loop does not use the task afterwards.
  virtual void on_deferred_done() = 0;
};
// Length of a deferred task. Before a long task, the loop hands the lead to another thread, which may have to be woken.
enum class TaskLength : uint8_t { kShort, kLong };

class EventLoop {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Timers = std::multimap<Time, std::function<void()>>;

  explicit EventLoop(EventSource& source) : source_(source) {}
  EventLoop(const EventLoop&) = delete;
  EventLoop& operator=(const EventLoop&) = delete;

  // Passes `tag` to the loop, which calls tag.arrived(). Before post() returns, arrived() may have been called and the
  // tag may have been destroyed.
  void post(EventTag& tag);

  // Calls `callback` at `time`, unless the returned timer is passed to cancel() before.
  Timers::iterator at(Time time, std::function<void()> callback);
  void cancel(Timers::iterator timer) { timers_.erase(timer); }

  // Runs `work`, without the lock, after the handler that calls defer() and the other handlers of the same turn() have
  // returned.
  void defer(DeferredTask& work, TaskLength length) { deferred_.push_back({&work, length}); }

  // Waits until this thread is the leader, then waits for an event, a posted tag or a timer, and handles it. Returns
  // false once the source has ended. Every thread of the loop calls turn() repeatedly.
  bool turn() LOCUS_EXCLUDES(mutex_);

 private:
  struct Deferred {
    DeferredTask* work;
    TaskLength length;
  };

  // Waits for the lead. Returns the maximum time that this thread may sleep as the leader, or no value once the source
  // has ended.
  std::optional<std::chrono::steady_clock::duration> acquire_lead() LOCUS_EXCLUDES(mutex_);
  void release_lead() LOCUS_REQUIRES(mutex_);
  void end() LOCUS_REQUIRES(mutex_);
  EventSource::Next next(std::chrono::steady_clock::duration wait, EventTag** tag, bool* ok);
  void run_posted();
  void run_timers();
  void run_deferred() LOCUS_REQUIRES(mutex_);

  EventSource& source_;
  std::atomic<EventTag*> posted_{nullptr};
  std::atomic<bool> asleep_{false};  // the leader sleeps or is about to sleep: post() must interrupt it

  Mutex mutex_;
  Semaphore lead_;  // lead_.post() wakes one thread that waits for the lead
  bool led_ LOCUS_GUARDED_BY(mutex_) = false;
  bool ended_ LOCUS_GUARDED_BY(mutex_) = false;
  uint32_t followers_ LOCUS_GUARDED_BY(mutex_) = 0;
  // Timers and deferred tasks, guarded by mutex_. The members have no lock annotations, because the handlers that use
  // them run under mutex_ but have no lock annotations.
  Timers timers_;
  std::deque<Deferred> deferred_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_EVENT_LOOP_H_
