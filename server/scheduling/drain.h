// The way from serving to ended, seen by all who must take part: first no new work (draining), then, when the grace is
// used up, no work at all (ended). Listeners are told of the first step, so that those who block can wake up.
//
// Threads: every member may be called from any thread, begin() and end() not from a listener. Invariant: a listener is
// never called after its Subscription is gone, and each is called at most once.
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

  // Ends the subscription when dropped; waits for a call of the listener that is in work.
  class Subscription {
   public:
    Subscription(Drain& drain, Listener listener) : drain_(drain), place_(drain.add(std::move(listener))) {}
    ~Subscription() { drain_.remove(place_); }
    Subscription(const Subscription&) = delete;
    Subscription& operator=(const Subscription&) = delete;

   private:
    Drain& drain_;
    std::list<Listener>::iterator place_;
  };

  bool draining() const { return draining_.load(); }
  bool ended() const { return ended_.load(); }
  // For work that takes a flag to look at.
  const std::atomic<bool>* ended_flag() const { return &ended_; }

  void begin() LOCUS_EXCLUDES(mutex_);
  void end() { ended_.store(true); }

 private:
  // A listener that comes while draining is called at once.
  std::list<Listener>::iterator add(Listener listener) LOCUS_EXCLUDES(mutex_);
  void remove(std::list<Listener>::iterator place) LOCUS_EXCLUDES(mutex_);

  std::atomic<bool> draining_{false};
  std::atomic<bool> ended_{false};
  Mutex mutex_;
  std::list<Listener> listeners_ LOCUS_GUARDED_BY(mutex_);
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_DRAIN_H_
