#include "server/scheduling/query_scheduler.h"

#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "server/scheduling/clocks.h"
#include "server/scheduling/thread_priority.h"

namespace locus::server {
namespace {

constexpr double kNanosecondsPerMs = 1e6;
constexpr uint32_t kMaxRetryMs = 10'000;
// While jobs of both classes wait, about one turn in kLargeShare is given to a large job.
constexpr uint64_t kLargeShare = 5;
// Maximum number of withdrawn tickets that stay queued until their turn. Beyond this number, all withdrawn tickets are
// removed from the queue.
constexpr uint32_t kMaxTombstones = 256;

constexpr const char* kJobLimits[kJobClasses] = {"small_batches", "large_batches"};
constexpr const char* kWorkLimits[kJobClasses] = {"small_batch_work_ms", "large_batch_work_ms"};
constexpr const char* kAllJobsLimit = "batches";
constexpr const char* kAllWorkLimit = "batch_work_ms";

SchedulerOptions with_clock(SchedulerOptions options) {
  if (!options.clock) options.clock = &steady_nanoseconds;
  return options;
}

}  // namespace

class QueryScheduler::Ticket {
 public:
  Ticket(QueryJob& of, uint64_t whose, uint64_t estimated, JobClass as)
      : job(of), client(whose), nanoseconds(estimated), admitted_as(as), job_class(as) {}

  // Adds this thread to the threads that work on the job; returns false if the ticket was withdrawn. `state_` contains
  // the number of these threads and two flags, kWithdrawn and kFinished.
  bool begin_work() {
    uint32_t state = state_.load(std::memory_order_relaxed);
    LOCUS_DCHECK_LT(state & kWorkers, kWorkers);
    while ((state & kWithdrawn) == 0)
      if (state_.compare_exchange_weak(state, state + 1, std::memory_order_acq_rel)) return true;
    return false;
  }
  void finish() { state_.fetch_or(kFinished, std::memory_order_relaxed); }
  // Removes this thread from the threads that work on the job. Returns true if this was the last thread and the job is
  // finished.
  bool end_work() {
    const uint32_t before = state_.fetch_sub(1, std::memory_order_acq_rel);
    LOCUS_DCHECK_LT(0u, before & kWorkers);
    LOCUS_DCHECK_EQ(before & kWithdrawn, 0u);
    return before - 1 == kFinished;
  }
  bool alone() const { return (state_.load(std::memory_order_relaxed) & kWorkers) == 1; }
  bool finished() const { return (state_.load(std::memory_order_relaxed) & kFinished) != 0; }
  bool withdrawn() const { return (state_.load(std::memory_order_acquire) & kWithdrawn) != 0; }
  bool withdraw() {
    uint32_t waiting = 0;
    return state_.compare_exchange_strong(waiting, kWithdrawn, std::memory_order_acq_rel);
  }

  QueryJob& job;
  const uint64_t client;
  const uint64_t nanoseconds;  // estimated work of the job
  const JobClass admitted_as;
  Ticket* next = nullptr;        // next in the inbox
  std::shared_ptr<Ticket> self;  // keeps the ticket alive while the scheduler may use it

  // Used by pool threads only, under the scheduler's mutex.
  JobClass job_class;
  bool queued = false;
  uint64_t spent = 0;

 private:
  static constexpr uint32_t kWithdrawn = 1u << 31, kFinished = 1u << 30, kWorkers = kFinished - 1;

  std::atomic<uint32_t> state_{0};
};

QueryScheduler::QueryScheduler(const SchedulerOptions& options) : options_(with_clock(options)) {
  LOCUS_CHECK_LE(1u, options.threads);
  LOCUS_CHECK_LE(options.threads, limits::kMaxThreads);
  for (uint32_t i = 0; i < options.threads; ++i) threads_.emplace_back([this] { run(); });
}

QueryScheduler::~QueryScheduler() {
  ended_.store(true);
  for (size_t i = 0; i < threads_.size(); ++i) wake_.post();
  for (std::thread& thread : threads_) thread.join();
}

Progress QueryScheduler::run_inline(QueryJob& job) {
  const Progress progress = job.work(options_.inline_nanoseconds);
  if (progress == Progress::kDone) inline_done_.fetch_add(1, std::memory_order_relaxed);
  return progress;
}

absl::StatusOr<QueryScheduler::TicketPtr> QueryScheduler::submit(QueryJob& job, uint64_t client, uint64_t nanoseconds) {
  const JobClass job_class = nanoseconds <= options_.small_nanoseconds ? JobClass::kSmall : JobClass::kLarge;
  RETURN_IF_ERROR(admit(job_class, nanoseconds));
  auto ticket = std::make_shared<Ticket>(job, client, nanoseconds, job_class);
  ticket->self = ticket;
  // Once the ticket is in the inbox, the job may be done at any time and must not be used here any more.
  Ticket* first = inbox_.load(std::memory_order_relaxed);
  do ticket->next = first;
  while (!inbox_.compare_exchange_weak(first, ticket.get(), std::memory_order_release, std::memory_order_relaxed));
  wake_.post();
  return ticket;
}

absl::Status QueryScheduler::admit(JobClass job_class, uint64_t nanoseconds) {
  const auto index = static_cast<size_t>(job_class);
  Admitted& admitted = admitted_[index];
  const Admitted& other = admitted_[1 - index];
  // Count the job before checking, so that concurrent calls cannot exceed a limit together.
  const uint64_t jobs = admitted.jobs.fetch_add(1) + 1;
  const uint64_t work = admitted.nanoseconds.fetch_add(nanoseconds) + nanoseconds;
  absl::Status status = check_jobs(kJobLimits[index], options_.limits[index].jobs, jobs);
  if (status.ok()) status = check_jobs(kAllJobsLimit, options_.limit.jobs, jobs + other.jobs.load());
  if (!status.ok()) {
    admitted.refused_jobs.fetch_add(1, std::memory_order_relaxed);
  } else {
    status = check_work(kWorkLimits[index], options_.limits[index].nanoseconds, work, nanoseconds);
    if (status.ok())
      status = check_work(kAllWorkLimit, options_.limit.nanoseconds, work + other.nanoseconds.load(), nanoseconds);
    if (!status.ok()) admitted.refused_work.fetch_add(1, std::memory_order_relaxed);
  }
  if (status.ok()) return status;
  admitted.jobs.fetch_sub(1);
  admitted.nanoseconds.fetch_sub(nanoseconds);
  return status;
}

absl::Status QueryScheduler::check_jobs(const char* name, uint64_t limit, uint64_t jobs) const {
  if (jobs <= limit) return absl::OkStatus();
  return refuse_full("", name, static_cast<double>(limit), static_cast<double>(jobs), retry_after_ms());
}

absl::Status QueryScheduler::check_work(const char* name, uint64_t limit, uint64_t work, uint64_t job_work) const {
  limit *= options_.threads;
  if (work <= limit || work == job_work) return absl::OkStatus();
  return refuse_full("", name, static_cast<double>(limit) / kNanosecondsPerMs,
                     static_cast<double>(work) / kNanosecondsPerMs, retry_after_ms());
}

// Returns the time in milliseconds in which half of the admitted work should be done, clamped to 1 .. kMaxRetryMs.
uint32_t QueryScheduler::retry_after_ms() const {
  double work = 0;
  for (const Admitted& admitted : admitted_) work += static_cast<double>(admitted.nanoseconds.load());
  const double milliseconds = work / 2 / options_.threads / kNanosecondsPerMs;
  return static_cast<uint32_t>(std::clamp(milliseconds, 1.0, static_cast<double>(kMaxRetryMs)));
}

void QueryScheduler::release(const Ticket& ticket) {
  Admitted& admitted = admitted_[static_cast<size_t>(ticket.admitted_as)];
  const uint64_t jobs = admitted.jobs.fetch_sub(1);
  const uint64_t nanoseconds = admitted.nanoseconds.fetch_sub(ticket.nanoseconds);
  LOCUS_DCHECK_LE(1u, jobs);
  LOCUS_DCHECK_LE(ticket.nanoseconds, nanoseconds);
}

bool QueryScheduler::withdraw(Ticket& ticket) {
  if (!ticket.withdraw()) return false;
  release(ticket);
  admitted_[static_cast<size_t>(ticket.admitted_as)].withdrawn.fetch_add(1, std::memory_order_relaxed);
  tombstones_.fetch_add(1, std::memory_order_relaxed);
  return true;
}

SchedulerStats QueryScheduler::stats() const {
  SchedulerStats stats;
  for (size_t i = 0; i < kJobClasses; ++i) {
    const Admitted& admitted = admitted_[i];
    stats.jobs[i] = admitted.jobs.load(std::memory_order_relaxed);
    stats.nanoseconds[i] = admitted.nanoseconds.load(std::memory_order_relaxed);
    stats.done[i] = admitted.done.load(std::memory_order_relaxed);
    stats.withdrawn[i] = admitted.withdrawn.load(std::memory_order_relaxed);
    stats.refused_jobs[i] = admitted.refused_jobs.load(std::memory_order_relaxed);
    stats.refused_work[i] = admitted.refused_work.load(std::memory_order_relaxed);
  }
  stats.inline_done = inline_done_.load(std::memory_order_relaxed);
  stats.worked_nanoseconds = worked_.load(std::memory_order_relaxed);
  return stats;
}

void QueryScheduler::run() {
  take_batch_priority(options_.priority);
  while (Ticket* const ticket = next()) {
    const uint64_t start = options_.clock();
    const Progress progress = ticket->job.work(options_.turn_nanoseconds);
    const uint64_t spent = options_.clock() - start;
    worked_.fetch_add(spent, std::memory_order_relaxed);
    if (!end_turn(*ticket, progress, spent)) continue;
    release(*ticket);
    admitted_[static_cast<size_t>(ticket->admitted_as)].done.fetch_add(1, std::memory_order_relaxed);
    const TicketPtr last = std::move(ticket->self);
    LOCUS_DCHECK(last != nullptr && !last->queued);
    last->job.done();
  }
}

QueryScheduler::Ticket* QueryScheduler::next() {
  while (true) {
    {
      MutexLock lock(mutex_);
      drain_inbox();
      if (Ticket* const ticket = start_turn()) return ticket;
      if (ended_.load()) return nullptr;
      sleepers_.fetch_add(1);
    }
    wake_.wait();
    sleepers_.fetch_sub(1);
  }
}

void QueryScheduler::drain_inbox() {
  Ticket* last_first = inbox_.exchange(nullptr, std::memory_order_acquire);
  Ticket* first = nullptr;
  while (last_first != nullptr) first = std::exchange(last_first, std::exchange(last_first->next, first));
  for (Ticket* ticket = first; ticket != nullptr; ticket = std::exchange(ticket->next, nullptr)) {
    LOCUS_DCHECK(!ticket->queued && ticket->self != nullptr);
    queue_of(*ticket).push_back(ticket->client, ticket);
    ticket->queued = true;
  }
  if (tombstones_.load(std::memory_order_relaxed) > kMaxTombstones) drop_withdrawn();
}

void QueryScheduler::drop_withdrawn() {
  for (FairQueue<Ticket*>& queue : queues_)
    for (Ticket* const ticket : queue.remove_if([](const Ticket* entry) { return entry->withdrawn(); })) drop(*ticket);
}

void QueryScheduler::drop(Ticket& ticket) {
  tombstones_.fetch_sub(1, std::memory_order_relaxed);
  ticket.self.reset();
}

FairQueue<QueryScheduler::Ticket*>& QueryScheduler::queue_of(const Ticket& ticket) {
  return queues_[static_cast<size_t>(ticket.job_class)];
}

FairQueue<QueryScheduler::Ticket*>& QueryScheduler::next_class() {
  FairQueue<Ticket*>& small = queues_[static_cast<size_t>(JobClass::kSmall)];
  FairQueue<Ticket*>& large = queues_[static_cast<size_t>(JobClass::kLarge)];
  if (large.empty()) {
    small_in_a_row_ = 0;
    return small;
  }
  if (!small.empty() && small_in_a_row_ < (kLargeShare - 1) * options_.turn_nanoseconds) {
    small_in_a_row_ += options_.turn_nanoseconds;
    return small;
  }
  small_in_a_row_ = 0;
  return large;
}

QueryScheduler::Ticket* QueryScheduler::start_turn() {
  while (true) {
    FairQueue<Ticket*>& queue = next_class();
    if (queue.empty()) return nullptr;
    Ticket* const ticket = queue.next(options_.turn_nanoseconds);
    if (ticket->begin_work()) {
      // The ticket stays queued, so that other threads may work on the job too. Wake a thread if the job is long
      // enough.
      const bool long_enough = ticket->spent > 0 || ticket->nanoseconds > options_.turn_nanoseconds;
      if (long_enough && sleepers_.load() > 0) wake_.post();
      return ticket;
    }
    queue.charge(ticket->client, -static_cast<int64_t>(options_.turn_nanoseconds));
    queue.remove(ticket->client, ticket);
    drop(*ticket);
  }
}

bool QueryScheduler::end_turn(Ticket& ticket, Progress progress, uint64_t spent) {
  MutexLock lock(mutex_);
  const auto more = static_cast<int64_t>(spent) - static_cast<int64_t>(options_.turn_nanoseconds);
  queue_of(ticket).charge(ticket.client, more);
  ticket.spent += spent;
  if (progress == Progress::kDone) ticket.finish();
  requeue(ticket, progress);
  return ticket.end_work();
}

// Queues the job again, or removes it from its queue, after a turn that returned `progress`. Progress::kBegun means
// that no chunk of the job may be started now, so the job leaves the queue until a thread that works on it returns
// kMore. Exception: the last working thread queues an unfinished job again even after kBegun, because a kMore of
// another thread may have been processed before this kBegun. A small job that took too long continues as a large job.
void QueryScheduler::requeue(Ticket& ticket, Progress progress) {
  const bool waits = !ticket.finished() && (progress == Progress::kMore || ticket.alone());
  const bool grown = ticket.job_class == JobClass::kSmall && ticket.spent > 2 * options_.small_nanoseconds;
  if (ticket.queued && (!waits || grown)) {
    queue_of(ticket).remove(ticket.client, &ticket);
    ticket.queued = false;
  }
  if (grown) ticket.job_class = JobClass::kLarge;
  if (!waits || ticket.queued) return;
  queue_of(ticket).push_front(ticket.client, &ticket);
  ticket.queued = true;
}

}  // namespace locus::server
