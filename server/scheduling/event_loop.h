// Events from one source, taken by a few threads of which one at a time waits for them: the leader. It does what
// follows from an event, and while that is short it goes on leading, so that a stream of short work costs no wake-up at
// all. Before work that takes a while it leaves the lead to another thread; so as many such works as there are threads
// go on at once.
//
// Everything that happens to the members of a loop happens under its lock, so they need none of their own: handlers of
// events and timers, and the end of work set aside, but not that work itself. Method: D. C. Schmidt, C. O'Ryan,
// I. Pyarali, M. Kircher and F. Buschmann, Leader/Followers (2000).
//
// Threads: post() may be called from any thread, also one of low priority: it takes no lock, so nobody waits for the
// poster if it loses its core. Everything else belongs to handlers, or to the time before the first turn().
// Lifetime: a poster may still be in post() when its tag has arrived, so posters end before the loop goes.
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

// What an event source or post() gives back. One that is on its way must stay until it came.
class EventTag {
 public:
  virtual ~EventTag() = default;
  // `ok` as the source says for the operation; true for what was posted.
  virtual void arrived(bool ok) = 0;

 private:
  friend class EventLoop;
  EventTag* next_ = nullptr;  // among what was posted
};

// A tag that calls a member function of its owner.
template <class Owner>
class MemberTag final : public EventTag {
 public:
  MemberTag(Owner& owner, void (Owner::*member)(bool)) : owner_(owner), member_(member) {}
  void arrived(bool ok) override { (owner_.*member_)(ok); }

 private:
  Owner& owner_;
  void (Owner::*member_)(bool);
};

// Where events come from.
class EventSource {
 public:
  enum class Next : uint8_t { kEvent, kNothing, kEnd };

  virtual ~EventSource() = default;
  // Waits for an event, at most so long; kEnd when there will be none any more. Called by one thread at a time.
  virtual Next next(std::chrono::steady_clock::duration wait, EventTag** tag, bool* ok) = 0;
  // Makes a next() that waits return soon. From any thread, also one of low priority: waits for nobody.
  virtual void interrupt() = 0;
};

// Work that a handler sets aside to be done without the lock, by a thread of the loop.
class DeferredTask {
 public:
  virtual ~DeferredTask() = default;
  virtual void run_deferred() = 0;
  // Under the lock, once that has returned. The loop never touches the work again.
  virtual void on_deferred_done() = 0;
};
// Whether another thread should lead meanwhile, who may have to be woken for that.
enum class TaskLength : uint8_t { kShort, kLong };

class EventLoop {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Timers = std::multimap<Time, std::function<void()>>;

  explicit EventLoop(EventSource& source) : source_(source) {}
  EventLoop(const EventLoop&) = delete;
  EventLoop& operator=(const EventLoop&) = delete;

  // Hands `tag` to the loop. It may arrive, and its owner be gone, before this returns.
  void post(EventTag& tag);

  // `then` is called once it is `time`, unless cancelled.
  Timers::iterator at(Time time, std::function<void()> then);
  void cancel(Timers::iterator timer) { timers_.erase(timer); }

  // `work` is done as soon as the handler has returned.
  void defer(DeferredTask& work, TaskLength length) { deferred_.push_back({&work, length}); }

  // Waits for its turn to lead, then for something to happen, and does what follows from it; false once the source has
  // ended. What every thread of the loop does again and again.
  bool turn() LOCUS_EXCLUDES(mutex_);

 private:
  struct Deferred {
    DeferredTask* work;
    TaskLength length;
  };

  // How long the leader may sleep; none at the end.
  std::optional<std::chrono::steady_clock::duration> take_lead() LOCUS_EXCLUDES(mutex_);
  void leave_lead() LOCUS_REQUIRES(mutex_);
  void end() LOCUS_REQUIRES(mutex_);
  EventSource::Next next(std::chrono::steady_clock::duration wait, EventTag** tag, bool* ok);
  void run_posted();
  void run_timers();
  void run_deferred() LOCUS_REQUIRES(mutex_);

  EventSource& source_;
  std::atomic<EventTag*> posted_{nullptr};
  std::atomic<bool> asleep_{false};  // the leader, or about to be: what is posted needs an interruption

  Mutex mutex_;
  Semaphore lead_;  // for those who wait to lead
  bool led_ LOCUS_GUARDED_BY(mutex_) = false;
  bool ended_ LOCUS_GUARDED_BY(mutex_) = false;
  uint32_t followers_ LOCUS_GUARDED_BY(mutex_) = 0;
  // Of handlers, who run under the lock without knowing of it.
  Timers timers_;
  std::deque<Deferred> deferred_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_EVENT_LOOP_H_
