// Scheduler of large query batches (jobs) on a few threads of low priority. Small jobs have precedence over large jobs,
// all clients get equal shares, and a client that is alone gets all threads. Batches whose estimated work is below a
// budget are run by their caller instead (runs_inline()). The number of jobs and their estimated work are limited, for
// each class and for both classes together; a job that exceeds a limit is refused immediately.
//
// Threads: every member may be called from any thread, and no member waits for a pool thread, which may be preempted at
// any point. Several pool threads may call a job's work() at the same time. After the last of these calls has returned,
// one thread calls done(), once.
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

// Query batch on which pool threads work in turns of limited time. The job itself ends its work early if its call was
// cancelled or the call's deadline has passed.
class QueryJob {
 public:
  virtual ~QueryJob() = default;

  // Works for about `nanoseconds`, then returns. Several threads may call it at the same time.
  virtual Progress work(uint64_t nanoseconds) = 0;

  // Reports that the job is complete. Called once, after a call of work() has returned kDone and all other calls of
  // work() have returned. The scheduler does not use the job afterwards. Must not block.
  virtual void done() = 0;
};

// Class of a job by its estimated work. A small job that turns out to be large continues as a large job.
enum class JobClass : uint8_t { kSmall, kLarge };
inline constexpr size_t kJobClasses = 2;

struct QueueLimit {
  uint32_t jobs;         // maximum number of waiting and running jobs
  uint64_t nanoseconds;  // maximum sum of the jobs' estimated work; one job alone is always admitted
};

struct SchedulerOptions {
  uint32_t threads = 1;
  BatchPriority priority = BatchPriority::kNice;
  uint64_t inline_nanoseconds = 250'000;  // jobs with less estimated work are not queued
  uint64_t turn_nanoseconds = 100'000;    // length of a turn, after which the next job is chosen
  uint64_t small_nanoseconds = 400'000;   // jobs with at most this estimated work are small
  // Limits for each JobClass (`limits`), and for both classes together (`limit`). The scheduler multiplies each
  // QueueLimit::nanoseconds by the number of threads.
  QueueLimit limits[kJobClasses] = {{1024, 500'000'000}, {1024, 2'000'000'000}};
  QueueLimit limit = {1536, 2'000'000'000};
  // Function that returns nanoseconds since an arbitrary start, for measuring the work of the calling thread. Default:
  // steady_nanoseconds().
  std::function<uint64_t()> clock;
};

// Counters of the scheduler. All counters except `jobs` and `nanoseconds` never decrease.
struct SchedulerStats {
  uint64_t jobs[kJobClasses] = {};         // waiting and running jobs
  uint64_t nanoseconds[kJobClasses] = {};  // estimated work of these jobs
  uint64_t done[kJobClasses] = {};         // jobs done
  uint64_t withdrawn[kJobClasses] = {};
  uint64_t refused_jobs[kJobClasses] = {};  // jobs refused because a limit of jobs was reached
  uint64_t refused_work[kJobClasses] = {};  // jobs refused because a limit of estimated work was reached
  uint64_t inline_done = 0;                 // jobs done by their caller without being queued
  uint64_t worked_nanoseconds = 0;          // time spent by pool threads
};

class QueryScheduler {
 public:
  // Submitted job, which the caller can withdraw.
  class Ticket;
  using TicketPtr = std::shared_ptr<Ticket>;

  explicit QueryScheduler(const SchedulerOptions& options);
  // Returns once every admitted job is done.
  ~QueryScheduler();
  QueryScheduler(const QueryScheduler&) = delete;
  QueryScheduler& operator=(const QueryScheduler&) = delete;

  // Returns whether the caller should run a job of this estimated work itself instead of queuing it.
  bool runs_inline(uint64_t nanoseconds) const { return nanoseconds < options_.inline_nanoseconds; }

  // Runs the job on the calling thread for about inline_nanoseconds. If run_inline() returns kDone, the job is complete
  // and done() is not called. Otherwise the estimate was too low, and the caller must submit() the job, which then
  // continues.
  Progress run_inline(QueryJob& job);

  // Queues a job of the client `client` with the estimated work `nanoseconds`. done() will be called, perhaps before
  // submit() returns. If a queue limit is exceeded, returns RESOURCE_EXHAUSTED naming the limit; then done() is not
  // called.
  absl::StatusOr<TicketPtr> submit(QueryJob& job, uint64_t client, uint64_t nanoseconds) LOCUS_EXCLUDES(mutex_);

  // If the job is not done and no thread is working on it, removes the job and returns true; done() is then not called.
  // Otherwise returns false: done() was called already or will be called. The job must then end its work early, so that
  // done() is called soon.
  bool withdraw(Ticket& ticket);

  SchedulerStats stats() const;
  const SchedulerOptions& options() const { return options_; }
  uint32_t threads() const { return static_cast<uint32_t>(threads_.size()); }

 private:
  // Counters of one JobClass. `jobs` is the number of waiting and running jobs of the class, `nanoseconds` is the
  // estimated work of these jobs.
  struct Admitted {
    std::atomic<uint64_t> jobs{0}, nanoseconds{0};
    std::atomic<uint64_t> done{0}, withdrawn{0}, refused_jobs{0}, refused_work{0};
  };

  absl::Status admit(JobClass job_class, uint64_t nanoseconds);
  absl::Status check_jobs(const char* name, uint64_t limit, uint64_t jobs) const;
  // Checks that `work`, in nanoseconds, is at most `limit` times the number of threads. `work` includes `job_work`, the
  // work of the new job. The work of a job that is the only job is not limited.
  absl::Status check_work(const char* name, uint64_t limit, uint64_t work, uint64_t job_work) const;
  uint32_t retry_after_ms() const;
  void release(const Ticket& ticket);

  void run();
  // Waits for a ticket to work on and begins its work. Returns null once the scheduler is being destroyed and no ticket
  // waits.
  Ticket* next();
  Ticket* start_turn() LOCUS_REQUIRES(mutex_);
  FairQueue<Ticket*>& next_class() LOCUS_REQUIRES(mutex_);
  void drain_inbox() LOCUS_REQUIRES(mutex_);
  void drop_withdrawn() LOCUS_REQUIRES(mutex_);
  void drop(Ticket& ticket) LOCUS_REQUIRES(mutex_);
  // Ends a turn: charges `spent` nanoseconds to the client. Returns true if this was the last thread of a finished job.
  bool end_turn(Ticket& ticket, Progress progress, uint64_t spent) LOCUS_EXCLUDES(mutex_);
  void requeue(Ticket& ticket, Progress progress) LOCUS_REQUIRES(mutex_);
  FairQueue<Ticket*>& queue_of(const Ticket& ticket) LOCUS_REQUIRES(mutex_);

  const SchedulerOptions options_;
  Admitted admitted_[kJobClasses];
  std::atomic<uint64_t> inline_done_{0};
  std::atomic<uint64_t> worked_{0};
  std::atomic<Ticket*> inbox_{nullptr};  // list of submitted tickets, newest first
  std::atomic<uint32_t> sleepers_{0};
  std::atomic<uint32_t> tombstones_{0};  // number of withdrawn tickets that are still queued
  std::atomic<bool> ended_{false};
  Semaphore wake_;

  // Locked by pool threads only.
  Mutex mutex_;
  FairQueue<Ticket*> queues_[kJobClasses] LOCUS_GUARDED_BY(mutex_);
  // Nanoseconds of turns of small jobs since the last turn of a large job; counted only while large jobs wait.
  uint64_t small_in_a_row_ LOCUS_GUARDED_BY(mutex_) = 0;
  std::vector<std::thread> threads_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_QUERY_SCHEDULER_H_
