// Threads with a completion queue each, on which calls live. Everything of a call happens on the thread it began on, so
// calls need no locks; what others do for it comes back by post(). Short work may be done there; nothing may wait
// there.
//
// Threads: a thread's members belong to that thread, but for post() and queue(). post() is safe for threads of lower
// priority: it calls no gRPC and takes no lock, so nobody waits for the poster if it loses its core. A thread of its
// own, the waker, tells gRPC where that is needed.
// Lifetime: stop() comes after the server's end and waits for the last call. A poster may still be in post() when its
// call has left, so posters end before the IoThreads go.
#ifndef LOCUS_SERVER_SERVICE_IO_THREADS_H_
#define LOCUS_SERVER_SERVICE_IO_THREADS_H_

#include <grpcpp/alarm.h>
#include <grpcpp/completion_queue.h>
#include <grpcpp/server_builder.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <thread>
#include <vector>

namespace locus::server {

// What a completion queue or post() gives back to an IO thread. One that is on its way must stay until it came.
class IoTag {
 public:
  virtual ~IoTag() = default;
  // `ok` as gRPC says for the operation; true for what was posted.
  virtual void arrived(bool ok) = 0;

 private:
  friend class IoThread;
  IoTag* next_ = nullptr;  // among what was posted
};

// A tag that calls a member function of its owner.
template <class Owner>
class MemberTag final : public IoTag {
 public:
  MemberTag(Owner& owner, void (Owner::*member)(bool)) : owner_(owner), member_(member) {}
  void arrived(bool ok) override { (owner_.*member_)(ok); }

 private:
  Owner& owner_;
  void (Owner::*member_)(bool);
};

// Wakes threads that sleep in gRPC, on behalf of those who may not call it.
class IoWaker;

class IoThread {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Timers = std::multimap<Time, std::function<void()>>;

  // A call that lives on this thread.
  class Resident {
   public:
    // The server drains.
    virtual void drain() = 0;

   protected:
    ~Resident() = default;
  };
  using Residents = std::list<Resident*>;

  IoThread(std::unique_ptr<grpc::ServerCompletionQueue> queue, IoWaker& waker);

  // Hands `tag` to the thread. It may arrive, and its owner be gone, before this returns.
  void post(IoTag& tag);
  grpc::ServerCompletionQueue* queue() { return queue_.get(); }

  // `then` is called once it is `time`, unless cancelled.
  Timers::iterator at(Time time, std::function<void()> then) { return timers_.emplace(time, std::move(then)); }
  void cancel(Timers::iterator timer) { timers_.erase(timer); }

  // Waits for something to happen and does what follows from it; false once the queue is shut down and empty. What the
  // thread does again and again.
  bool turn();

  // A call that gRPC may begin here: expected until it enters, or until gRPC says that it will not come.
  void expect() { expected_or_resident_.fetch_add(1); }
  void forgo();
  Residents::iterator enter(Resident& call);
  void leave(Residents::iterator call);

  // Whether no call lives here. On this thread.
  bool idle() const { return residents_.empty(); }
  // Whether none does and none can come any more. From any thread.
  bool empty() const { return expected_or_resident_.load() == 0; }

 private:
  friend class IoThreads;
  friend class IoWaker;

  void run_posted();
  void run_timers();
  // By a thread of its own that is `running`, or by taking turns here.
  void wait_until_empty(bool running);
  grpc::CompletionQueue::NextStatus next(void** tag, bool* ok);
  void woken(bool ok);
  void drain_residents(bool ok);

  const std::unique_ptr<grpc::ServerCompletionQueue> queue_;
  IoWaker& waker_;
  std::atomic<IoTag*> posted_{nullptr};
  std::atomic<bool> asleep_{false};  // or about to be: what is posted needs a wake-up
  std::atomic<bool> alarm_set_{false};
  std::atomic<uint32_t> expected_or_resident_{0};
  grpc::Alarm alarm_;  // the waker's
  MemberTag<IoThread> woken_{*this, &IoThread::woken};
  MemberTag<IoThread> drain_{*this, &IoThread::drain_residents};
  Timers timers_;
  Residents residents_;
};

class IoThreads {
 public:
  // Two, or half of `cores` where that is more; one on a single core. Measured on two: one polling thread a queue.
  static uint32_t count_for(uint32_t cores);

  // Before `builder` starts the server; threads run from start() on.
  IoThreads(grpc::ServerBuilder& builder, uint32_t count);
  ~IoThreads();
  IoThreads(const IoThreads&) = delete;
  IoThreads& operator=(const IoThreads&) = delete;

  size_t size() const { return threads_.size(); }
  IoThread& operator[](size_t i) { return *threads_[i]; }

  void start();
  // Tells every call, now and later, that the server drains. Once, from any thread.
  void drain();
  // Waits until every call has left, those included that came just before the server's end, then ends the threads. The
  // server is shut down already.
  void stop();

 private:
  std::unique_ptr<IoWaker> waker_;
  std::vector<std::unique_ptr<IoThread>> threads_;
  std::vector<std::thread> running_;
  bool stopped_ = false;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICE_IO_THREADS_H_
