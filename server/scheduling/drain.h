// State of a shutdown: first draining (no new work is accepted), then ended (all work stops), after a grace period.
// Listeners are called when draining begins, so that blocked threads can wake up.
//
// Threads: every member may be called from any thread, but begin() and end() must not be called from a listener.
// Invariant: a listener is called at most once, and never after its Subscription is destroyed.
#ifndef LOCUS_SERVER_SCHEDULING_DRAIN_H_
#define LOCUS_SERVER_SCHEDULING_DRAIN_H_

#include <atomic>
#include <functional>
#include <list>

#include "core/base/mutex.h"

namespace locus::server {

class Drain {
 public:
  using Listener = std::function<void()>;

  // Subscription of a listener. The destructor ends the subscription and waits for a running call of the listener.
  class Subscription {
   public:
    Subscription(Drain& drain, Listener listener) : drain_(drain), position_(drain.add(std::move(listener))) {}
    ~Subscription() { drain_.remove(position_); }
    Subscription(const Subscription&) = delete;
    Subscription& operator=(const Subscription&) = delete;

   private:
    Drain& drain_;
    std::list<Listener>::iterator position_;
  };

  bool draining() const { return draining_.load(); }
  bool ended() const { return ended_.load(); }
  // Returns a flag that becomes true when the grace period is over, for work that polls whether it must stop.
  const std::atomic<bool>* ended_flag() const { return &ended_; }

  void begin() LOCUS_EXCLUDES(mutex_);
  void end() { ended_.store(true); }

 private:
  // Adds a listener. If draining has already begun, calls the listener immediately.
  std::list<Listener>::iterator add(Listener listener) LOCUS_EXCLUDES(mutex_);
  void remove(std::list<Listener>::iterator position) LOCUS_EXCLUDES(mutex_);

  std::atomic<bool> draining_{false};
  std::atomic<bool> ended_{false};
  Mutex mutex_;
  std::list<Listener> listeners_ LOCUS_GUARDED_BY(mutex_);
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_DRAIN_H_
