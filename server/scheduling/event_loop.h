// Event loop run by a few threads. One of them at a time, the leader, waits for the next event and runs its handler. A
// leader with short handlers keeps the lead, so a stream of short events causes no thread switch. Before a long
// deferred task it hands the lead to another thread, so as many long tasks run concurrently as there are threads.
// Method: D. C. Schmidt, C. O'Ryan, I. Pyarali, M. Kircher and F. Buschmann, Leader/Followers (2000).
//
// Handlers of events and timers and on_deferred_done() run under the lock of the loop, so the objects they share need
// no lock of their own. Deferred tasks run without it.
//
// Threads: post() may be called from any thread. It takes no lock, so no thread waits for a poster of low priority that
// lost its core. All other members may be called only by handlers, or before the first turn(). Lifetime: a tag may
// arrive while its poster is still in post(), so all posters must end before the loop is destroyed. Invariant: at most
// one thread leads.
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

// Handler of an event. post() or the event source hands it to the loop, which calls arrived(). It must not be destroyed
// before that call.
class EventTag {
 public:
  virtual ~EventTag() = default;
  // Handles the event. `ok` is the source's result of the operation; true for a posted tag.
  virtual void arrived(bool ok) = 0;

 private:
  friend class EventLoop;
  EventTag* next_ = nullptr;  // next in the list of posted tags
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
  // Waits for an event, at most `wait`. Returns kEnd once there will be no more events. Called by one thread at a time.
  virtual Next next(std::chrono::steady_clock::duration wait, EventTag** tag, bool* ok) = 0;
  // Makes a waiting next() return soon. Any thread may call it; it takes no lock.
  virtual void interrupt() = 0;
};

// Task that a handler defers: a thread of the loop runs it without the lock.
class DeferredTask {
 public:
  virtual ~DeferredTask() = default;
  virtual void run_deferred() = 0;
  // Called under the lock after run_deferred() has returned. The loop does not use the task afterwards.
  virtual void on_deferred_done() = 0;
};
// Length of a deferred task. Before a long one the lead is handed to another thread, which may have to be woken.
enum class TaskLength : uint8_t { kShort, kLong };

class EventLoop {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Timers = std::multimap<Time, std::function<void()>>;

  explicit EventLoop(EventSource& source) : source_(source) {}
  EventLoop(const EventLoop&) = delete;
  EventLoop& operator=(const EventLoop&) = delete;

  // Hands `tag` to the loop, which calls its arrived(). That call, and the destruction of the tag, may come before this
  // returns.
  void post(EventTag& tag);

  // Calls `callback` at `time`, unless it is cancelled before.
  Timers::iterator at(Time time, std::function<void()> callback);
  void cancel(Timers::iterator timer) { timers_.erase(timer); }

  // Runs `work`, without the lock, as soon as the handler that calls this has returned.
  void defer(DeferredTask& work, TaskLength length) { deferred_.push_back({&work, length}); }

  // Waits until this thread leads, then for an event, a posted tag or a timer, and handles it. Returns false once the
  // source has ended. Every thread of the loop calls it repeatedly.
  bool turn() LOCUS_EXCLUDES(mutex_);

 private:
  struct Deferred {
    DeferredTask* work;
    TaskLength length;
  };

  // Waits for the lead. Returns the maximum time that this thread may sleep as the leader; nothing once the source has
  // ended.
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
  Semaphore lead_;  // wakes one of the threads that wait for the lead
  bool led_ LOCUS_GUARDED_BY(mutex_) = false;
  bool ended_ LOCUS_GUARDED_BY(mutex_) = false;
  uint32_t followers_ LOCUS_GUARDED_BY(mutex_) = 0;
  // Used by handlers, which run under mutex_ but carry no annotations.
  Timers timers_;
  std::deque<Deferred> deferred_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_EVENT_LOOP_H_
