// Loops with a completion queue each, on which calls live, and the threads that serve them. A call lives on one loop:
// whatever happens to it happens under that loop's lock, so calls need no locks of their own. Short work may be done
// there, longer work is set aside; nothing may wait.
//
// A loop has one thread at a time that waits in gRPC: of several, gRPC would have each wake the next for every event.
// Threads: as of server/scheduling/event_loop.h. Posting calls no gRPC; a thread of its own, the waker, tells gRPC
// where a loop has to be woken. Lifetime: stop() comes after the server's end and waits for the last call.
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

// Wakes loops that sleep in gRPC, on behalf of those who may not call it.
class IoWaker;

class IoLoop final : private EventSource, public EventLoop {
 public:
  // A call that lives here.
  class ActiveCall {
   public:
    // The server drains.
    virtual void drain() = 0;

   protected:
    ~ActiveCall() = default;
  };
  using ActiveCalls = std::list<ActiveCall*>;

  IoLoop(std::unique_ptr<grpc::ServerCompletionQueue> queue, IoWaker& waker);

  grpc::ServerCompletionQueue* queue() { return queue_.get(); }

  // A call that gRPC may begin here: expected until it enters, or until gRPC says that it will not come.
  void acquire() { expected_or_active_.fetch_add(1); }
  void release();
  ActiveCalls::iterator enter(ActiveCall& call) { return active_calls_.insert(active_calls_.end(), &call); }
  void leave(ActiveCalls::iterator call);

  // Whether no call lives here. For handlers.
  bool idle() const { return active_calls_.empty(); }
  // Whether none does and none can come any more. From any thread.
  bool empty() const { return expected_or_active_.load() == 0; }

 private:
  friend class IoThreads;
  friend class IoWaker;

  Next next(std::chrono::steady_clock::duration wait, EventTag** tag, bool* ok) override;
  void interrupt() override;

  // By threads that are `running`, or by taking turns here.
  void wait_until_empty(bool running);
  void woken(bool ok);
  void drain_active_calls(bool ok);

  const std::unique_ptr<grpc::ServerCompletionQueue> queue_;
  IoWaker& waker_;
  std::atomic<bool> wanted_{false};  // to be woken
  std::atomic<bool> alarm_set_{false};
  std::atomic<uint32_t> expected_or_active_{0};
  grpc::Alarm alarm_;  // the waker's
  MemberTag<IoLoop> woken_{*this, &IoLoop::woken};
  MemberTag<IoLoop> drain_{*this, &IoLoop::drain_active_calls};
  ActiveCalls active_calls_;
};

class IoThreads {
 public:
  // Threads in all, for so many cores: two, or half of them where that is more; one on a single core.
  static uint32_t count_for(uint32_t cores);
  static constexpr uint32_t kThreadsOfALoop = 2;

  // `count` threads for one loop, or for each loop kThreadsOfALoop. Before `builder` starts the server; threads run
  // from start() on.
  IoThreads(grpc::ServerBuilder& builder, uint32_t count);
  ~IoThreads();
  IoThreads(const IoThreads&) = delete;
  IoThreads& operator=(const IoThreads&) = delete;

  size_t loops() const { return loops_.size(); }
  IoLoop& loop(size_t i) { return *loops_[i]; }

  void start();
  // Tells every call, now and later, that the server drains. Once, from any thread.
  void drain();
  // Waits until every call has left, those included that came just before the server's end, then ends the threads. The
  // server is shut down already.
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
