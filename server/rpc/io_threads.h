// IO loops with one completion queue each, on which the frequent calls live, and the threads that serve them. A call
// lives on one loop and is only changed under that loop's lock, so it needs no lock of its own. Handlers may do short
// work; they defer longer work, and never block.
//
// One thread of a loop at a time waits in gRPC: if several did, gRPC would make each wake the next for every event.
// Threads: as in server/scheduling/event_loop.h. post() does not call gRPC; a separate thread, the waker, sets a gRPC
// alarm if a sleeping loop must be woken. Lifetime: call stop() after the server has ended; it waits for the last call.
#ifndef LOCUS_SERVER_RPC_IO_THREADS_H_
#define LOCUS_SERVER_RPC_IO_THREADS_H_

#include <grpcpp/alarm.h>
#include <grpcpp/completion_queue.h>
#include <grpcpp/server_builder.h>

#include <atomic>
#include <cstdint>
#include <list>
#include <memory>
#include <thread>
#include <vector>

#include "server/scheduling/event_loop.h"

namespace locus::server {

// Thread that wakes loops which sleep in gRPC, for threads that must not call gRPC themselves.
class IoWaker;

// One event loop over one completion queue, with the list of its calls.
class IoLoop final : private EventSource, public EventLoop {
 public:
  // Interface of a call that lives on this loop.
  class ActiveCall {
   public:
    // Called on the loop when the server begins to drain.
    virtual void drain() = 0;

   protected:
    ~ActiveCall() = default;
  };
  using ActiveCalls = std::list<ActiveCall*>;

  IoLoop(std::unique_ptr<grpc::ServerCompletionQueue> queue, IoWaker& waker);

  grpc::ServerCompletionQueue* queue() { return queue_.get(); }

  // Counts a call that was requested from gRPC. When such a call ends, leave() subtracts it; release() subtracts a call
  // that gRPC reports as never accepted.
  void acquire() { expected_or_active_.fetch_add(1); }
  void release();
  // Adds an accepted call to the list of active calls, or removes it when it ends. Only handlers may call them.
  ActiveCalls::iterator enter(ActiveCall& call) { return active_calls_.insert(active_calls_.end(), &call); }
  void leave(ActiveCalls::iterator call);

  // Returns whether no accepted call lives on this loop. Only handlers may call it.
  bool idle() const { return active_calls_.empty(); }
  // Returns whether there is no accepted call and no requested one. Safe to call from any thread.
  bool empty() const { return expected_or_active_.load() == 0; }

 private:
  friend class IoThreads;
  friend class IoWaker;

  Next next(std::chrono::steady_clock::duration wait, EventTag** tag, bool* ok) override;
  void interrupt() override;

  // Blocks until empty(). `running` says whether threads serve the loop; if not, calls turn() on the calling thread.
  void wait_until_empty(bool running);
  void woken(bool ok);
  void drain_active_calls(bool ok);

  const std::unique_ptr<grpc::ServerCompletionQueue> queue_;
  IoWaker& waker_;
  std::atomic<bool> wanted_{false};              // the loop must be woken
  std::atomic<bool> alarm_set_{false};           // an alarm is pending
  std::atomic<uint32_t> expected_or_active_{0};  // calls requested from gRPC or accepted
  grpc::Alarm alarm_;                            // used by the waker only
  MemberTag<IoLoop> woken_{*this, &IoLoop::woken};
  MemberTag<IoLoop> drain_{*this, &IoLoop::drain_active_calls};
  ActiveCalls active_calls_;
};

// The IO loops of a server and their threads.
class IoThreads {
 public:
  // Returns the number of threads for a machine with `cores` cores: 1 for one core, otherwise half the cores, clamped
  // to 2 .. 16.
  static uint32_t count_for(uint32_t cores);
  static constexpr uint32_t kThreadsOfALoop = 2;

  // Creates the loops for `count` threads, kThreadsOfALoop threads each, at least one loop. Call it before `builder`
  // starts the server. The threads run from start() on.
  IoThreads(grpc::ServerBuilder& builder, uint32_t count);
  ~IoThreads();
  IoThreads(const IoThreads&) = delete;
  IoThreads& operator=(const IoThreads&) = delete;

  size_t loops() const { return loops_.size(); }
  IoLoop& loop(size_t i) { return *loops_[i]; }

  void start();
  // Calls drain() of every active call, on its loop. Call it once, from any thread.
  void drain();
  // Waits until every call has left, including calls accepted just before the server's end, then ends the threads. The
  // server must be shut down already.
  void stop();

 private:
  const uint32_t count_;
  std::unique_ptr<IoWaker> waker_;
  std::vector<std::unique_ptr<IoLoop>> loops_;
  std::vector<std::thread> running_;
  bool stopped_ = false;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_IO_THREADS_H_
