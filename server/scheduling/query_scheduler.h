// Large query batches on a few threads of low priority: small jobs before large ones, clients in fair shares, all cores
// for one client when nobody else asks. What is estimated to take less than a budget never comes here but is run by
// whoever has it. Bounded by the number of jobs and by their estimated work, of each class and of both; what does not
// fit is refused at once.
//
// Threads: every member may be called from any thread, and none ever waits for a pool thread: those are of low priority
// and may have lost their processor anywhere. Pool threads call a job's work(), several at once, then, once, its
// done().
#ifndef LOCUS_SERVER_SCHEDULING_QUERY_SCHEDULER_H_
#define LOCUS_SERVER_SCHEDULING_QUERY_SCHEDULER_H_

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/mutex.h"
#include "core/query/run/progress.h"
#include "server/config/server_config.h"
#include "server/scheduling/fair_queue.h"
#include "server/scheduling/semaphore.h"

namespace locus::server {

// A batch that can be worked on in pieces. Stops itself when its caller is gone or its deadline has passed.
class QueryJob {
 public:
  virtual ~QueryJob() = default;

  // Does about so many nanoseconds of work. Called by several threads at once.
  virtual Progress work(uint64_t nanoseconds) = 0;

  // Called once, after work() returned kDone and all calls of it have come back; the scheduler never touches the job
  // again. Must not block: it should only pass the word on.
  virtual void done() = 0;
};

// By estimated work. A job that turns out to be large goes on as such.
enum class JobClass : uint8_t { kSmall, kLarge };
inline constexpr size_t kJobClasses = 2;

struct QueueLimit {
  uint32_t jobs;         // waiting or in work
  uint64_t nanoseconds;  // of them, as estimated; one job is let in however long it takes
};

struct SchedulerOptions {
  uint32_t threads = 1;
  BatchPriority priority = BatchPriority::kNice;
  uint64_t inline_nanoseconds = 250'000;  // jobs estimated below are not queued
  uint64_t turn_nanoseconds = 100'000;    // between two looks at whose turn it is
  uint64_t small_nanoseconds = 400'000;   // jobs estimated up to here are small
  // Of each class, by its number, and of both together. The work is for one thread: more threads, more work.
  QueueLimit limits[kJobClasses] = {{1024, 500'000'000}, {1024, 2'000'000'000}};
  QueueLimit limit = {1536, 2'000'000'000};
  // Nanoseconds since some moment, for the calling thread. [std::chrono::steady_clock]
  std::function<uint64_t()> clock;
};

// Plain numbers; all but the first two only grow.
struct SchedulerStats {
  uint64_t jobs[kJobClasses] = {};         // waiting or in work
  uint64_t nanoseconds[kJobClasses] = {};  // of them, as estimated
  uint64_t done[kJobClasses] = {};         // jobs
  uint64_t withdrawn[kJobClasses] = {};
  uint64_t refused_jobs[kJobClasses] = {};  // because of too many jobs
  uint64_t refused_work[kJobClasses] = {};  // because of too much work
  uint64_t inline_done = 0;                 // jobs that never were in the queue
  uint64_t worked_nanoseconds = 0;          // by pool threads
};

class QueryScheduler {
 public:
  class Ticket;
  using TicketPtr = std::shared_ptr<Ticket>;

  explicit QueryScheduler(const SchedulerOptions& options);
  // Works until every job is done.
  ~QueryScheduler();
  QueryScheduler(const QueryScheduler&) = delete;
  QueryScheduler& operator=(const QueryScheduler&) = delete;

  // Whether a job that should take so long is better done by whoever has it than queued.
  bool runs_inline(uint64_t nanoseconds) const { return nanoseconds < options_.inline_nanoseconds; }

  // Does that, as far as it gets within the budget. kDone: done() is not called. Otherwise the estimate was too low,
  // and the rest is to be submitted.
  Progress run_inline(QueryJob& job);

  // Queues a job: done() will be called, perhaps before this returns. RESOURCE_EXHAUSTED naming the limit when the
  // queue is full; then the job is left as it is.
  absl::StatusOr<TicketPtr> submit(QueryJob& job, uint64_t client, uint64_t nanoseconds) LOCUS_EXCLUDES(mutex_);

  // Takes a job that nobody works on right now out of the queue: true, and done() is not called. Otherwise somebody
  // does, or it is done, and done() was or will be called: soon, if the job stops itself.
  bool withdraw(Ticket& ticket);

  SchedulerStats stats() const;
  const SchedulerOptions& options() const { return options_; }
  uint32_t threads() const { return static_cast<uint32_t>(threads_.size()); }

 private:
  // What is admitted of one class.
  struct Admitted {
    std::atomic<uint64_t> jobs{0}, nanoseconds{0};
    std::atomic<uint64_t> done{0}, withdrawn{0}, refused_jobs{0}, refused_work{0};
  };

  absl::Status admit(JobClass job_class, uint64_t nanoseconds);
  absl::Status check_jobs(const char* limit, uint64_t most, uint64_t jobs) const;
  // `most` for one thread; `of_this` is the part of `work` that wants in.
  absl::Status check_work(const char* limit, uint64_t most, uint64_t work, uint64_t of_this) const;
  uint32_t retry_after_ms() const;
  void release(const Ticket& ticket);

  void run();
  // The next ticket to work on, its work begun; null at the end. Sleeps while there is none.
  Ticket* next();
  Ticket* take_turn() LOCUS_REQUIRES(mutex_);
  FairQueue<Ticket*>& class_in_turn() LOCUS_REQUIRES(mutex_);
  void take_in() LOCUS_REQUIRES(mutex_);
  void drop_withdrawn() LOCUS_REQUIRES(mutex_);
  void drop(Ticket& ticket) LOCUS_REQUIRES(mutex_);
  // Books a turn's work; true where it was the job's last.
  bool settle(Ticket& ticket, Progress progress, uint64_t spent) LOCUS_EXCLUDES(mutex_);
  void put_in_place(Ticket& ticket, Progress progress) LOCUS_REQUIRES(mutex_);
  FairQueue<Ticket*>& queue_of(const Ticket& ticket) LOCUS_REQUIRES(mutex_);

  const SchedulerOptions options_;
  Admitted admitted_[kJobClasses];
  std::atomic<uint64_t> inline_done_{0};
  std::atomic<uint64_t> worked_{0};
  std::atomic<Ticket*> inbox_{nullptr};  // submitted, the last first
  std::atomic<uint32_t> sleepers_{0};
  std::atomic<uint32_t> tombstones_{0};  // withdrawn and not yet dropped
  std::atomic<bool> ended_{false};
  Semaphore wake_;

  // Of pool threads only.
  Mutex mutex_;
  FairQueue<Ticket*> queues_[kJobClasses] LOCUS_GUARDED_BY(mutex_);
  uint64_t small_in_a_row_ LOCUS_GUARDED_BY(mutex_) = 0;  // nanoseconds that went to small jobs while large ones waited
  std::vector<std::thread> threads_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_QUERY_SCHEDULER_H_
