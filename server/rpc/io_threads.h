// IO loops: event loops over one gRPC completion queue each, for the events of all calls, and the threads that run the
// loops. A frequent call (query or update) belongs to one loop and is only changed under that loop's lock, so the call
// needs no lock of its own. Event handlers may do short work; they defer longer work, and never block.
//
// Only one thread of a loop at a time waits in gRPC: if several threads waited, gRPC would make each waiting thread
// wake the next thread for every event.
//
// Threads: any thread may call IoLoop::post(). post() does not call gRPC; if it must wake a sleeping loop, a separate
// thread, the waker, sets a gRPC alarm. Lifetime: call IoThreads::stop() after the server has ended; stop() waits for
// the last call.
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

// Thread that wakes loops which sleep in gRPC, on behalf of threads that must not call gRPC themselves.
class IoWaker;

// One event loop over one completion queue, with the list of its calls.
class IoLoop final : private EventSource, public EventLoop {
 public:
  // Interface of an accepted call that belongs to this loop.
  class ActiveCall {
   public:
    // Handles the beginning of the server's drain. Called on the loop.
    virtual void drain() = 0;
    // Ends the call if its caller no longer has the right to make it. Called on the loop when rights may have changed.
    virtual void recheck() = 0;
    // Ends the call if it has waited for its caller for too long. Called on the loop about once a second.
    virtual void end_if_stalled(EventLoop::Time now) = 0;

   protected:
    ~ActiveCall() = default;
  };
  using ActiveCalls = std::list<ActiveCall*>;

  IoLoop(std::unique_ptr<grpc::ServerCompletionQueue> queue, IoWaker& waker);

  grpc::ServerCompletionQueue* queue() { return queue_.get(); }

  // Counts a call that was requested from gRPC, until leave() is called because the accepted call has ended, or
  // release() because the call was never accepted.
  void acquire() { expected_or_active_.fetch_add(1); }
  void release();
  // Add an accepted call to the list of active calls, and remove it when the call ends. Only event handlers may call
  // enter() and leave().
  ActiveCalls::iterator enter(ActiveCall& call);
  void leave(ActiveCalls::iterator call);

  // Returns whether no accepted call belongs to this loop. Only event handlers may call idle().
  bool idle() const { return active_calls_.empty(); }
  // Returns whether this loop has no accepted call and no call that was requested from gRPC. Safe to call from any
  // thread.
  bool empty() const { return expected_or_active_.load() == 0; }

 private:
  friend class IoThreads;
  friend class IoWaker;

  Next next(std::chrono::steady_clock::duration wait, EventTag** tag, bool* ok) override;
  void interrupt() override;

  // Blocks until empty() returns true. `running` says whether threads run the loop; if not, calls turn() on the calling
  // thread.
  void wait_until_empty(bool running);
  void woken(bool ok);
  void drain_active_calls(bool ok);
  void recheck_active_calls(bool ok);
  void check_stalled_calls();

  const std::unique_ptr<grpc::ServerCompletionQueue> queue_;
  IoWaker& waker_;
  std::atomic<bool> wanted_{false};              // the loop must be woken
  std::atomic<bool> alarm_set_{false};           // an alarm is pending
  std::atomic<uint32_t> expected_or_active_{0};  // calls requested from gRPC or accepted
  grpc::Alarm alarm_;                            // used by the waker only
  MemberTag<IoLoop> woken_{*this, &IoLoop::woken};
  MemberTag<IoLoop> drain_{*this, &IoLoop::drain_active_calls};
  std::atomic<bool> recheck_posted_{false};
  MemberTag<IoLoop> recheck_{*this, &IoLoop::recheck_active_calls};
  ActiveCalls active_calls_;
  // True while the timer of check_stalled_calls() is set. The timer is set whenever there are active calls.
  bool stall_timer_set_ = false;
};

// The IO loops of a server and their threads.
class IoThreads {
 public:
  // Returns the number of threads for a machine with `cores` cores: 1 for one core, otherwise half the cores, clamped
  // to 2 .. 16.
  static uint32_t count_for(uint32_t cores);
  static constexpr uint32_t kThreadsOfALoop = 2;

  // Creates `count` / kThreadsOfALoop loops, but at least one. Call it before `builder` starts the server. start() then
  // starts `count` threads.
  IoThreads(grpc::ServerBuilder& builder, uint32_t count);
  ~IoThreads();
  IoThreads(const IoThreads&) = delete;
  IoThreads& operator=(const IoThreads&) = delete;

  size_t loops() const { return loops_.size(); }
  IoLoop& loop(size_t i) { return *loops_[i]; }

  void start();
  // Calls ActiveCall::drain() of every active call, on the call's loop. Call it once, from any thread.
  void drain();
  // Calls recheck() of every active call, on its loop. Any thread; not after stop().
  void recheck();
  // Waits until every call has ended, including calls accepted just before the server's end, then ends the threads. The
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
