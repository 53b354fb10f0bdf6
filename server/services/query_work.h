// One query batch, from its message to the columns of its reply: conversion and checks, the revision that it asks for,
// the queries, the answer. It never blocks the IO loop: while the revision is not published it is parked, short work is
// deferred until the handler has returned, and long work goes to the query scheduler.
//
//   begin() --> read() --error------------------------------------------------> done
//                 |
//                 v      the revision may still be published, and no drain
//               look() ------------------------------> PARKED --give_up()-----> done
//                 |  ^                                    |
//                 |  +--- timer, or woken() by the watch -+
//                 +--error: epoch, range, deadline, deleted, draining ---------> done
//                 | pinned
//                 v
//               run() --error of BatchRun::prepare() --------------------------> done
//                 |  \ estimate >= inline_nanoseconds
//                 |   \-----------------------+
//                 v                           v
//              DEFERRED --not finished--> submit() --queue is full ------------> done
//                 |                           |
//                 | finished                  v
//                 |                        QUEUED --give_up(), withdrawn ------> done
//                 |                           | all pool threads have left it
//                 v                           v
//              finished() <---- post ------ done()
//                 |
//                 +--> columns, metrics, or the error of the run --------------> done
//
// `done` in the drawing is answer(), which frees everything and calls CallSlot::answered() once. give_up() acts in
// PARKED and QUEUED only: elsewhere the run checks Caller::stop() itself.
//
// Threads: all members run on the call's IO loop, except run_deferred() (a thread of the loop, without its lock), and
// work() and done() (pool threads, work() on several at once).
#ifndef LOCUS_SERVER_SERVICES_QUERY_WORK_H_
#define LOCUS_SERVER_SERVICES_QUERY_WORK_H_

#include <atomic>
#include <memory>
#include <optional>
#include <string>

#include "core/query/query_batch.h"
#include "core/query/run/batch_run.h"
#include "core/scene/registry.h"
#include "locus/v1/query_service.pb.h"
#include "server/convert/result_columns.h"
#include "server/rpc/call_slot.h"
#include "server/rpc/io_threads.h"
#include "server/scheduling/query_scheduler.h"

namespace locus::server {

class QueryWork final : private QueryJob, private DeferredTask {
 public:
  explicit QueryWork(CallSlot& slot) : slot_(slot) {}

  // Begins the work. `batch` and `result` are borrowed until the slot is answered.
  void begin(const std::string& scene, const v1::QueryBatch& batch, v1::QueryResult& result);
  // Asks for an answer soon: ends the wait for a revision, and withdraws a queued run if the caller has given up. A run
  // in progress is not interrupted here, because it polls Caller::stop() itself.
  void give_up();

 private:
  absl::Status read(const std::string& scene, const v1::QueryBatch& batch);
  void answer(absl::Status status);

  // Pins the revision that the view names and calls run(), or parks the batch until that revision is published.
  void look();
  void wait();
  // Removes the timer and the watch. Returns whether the wait is over; false if woken() was already posted and will
  // run.
  bool end_wait();
  void woken(bool);
  // Returns the status of a parked batch that is given up: its revision will not be published any more.
  absl::Status no_longer() const;

  void run();
  // Works on the batch for about the inline budget of the scheduler, without the loop's lock.
  void run_deferred() override;
  void on_deferred_done() override;
  // Queues the batch, or the rest of it, at the query scheduler; `nanoseconds` is the estimate of its work.
  void submit(uint64_t nanoseconds);
  Progress work(uint64_t nanoseconds) override { return run_->work(nanoseconds); }
  void done() override;
  void finished(bool);
  void learn(const QueryBlock& block, const QueryCost& cost);
  void explain();
  void note_if_slow();

  CallSlot& slot_;
  const v1::QueryBatch* message_ = nullptr;
  v1::QueryResult* result_ = nullptr;
  ScenePtr scene_;
  View view_;
  QueryBatch batch_;
  SteadyTime until_;
  SteadyTime started_;  // start of run(): after the wait for a revision, if any

  // Used while the batch is parked.
  std::optional<IoLoop::Timers::iterator> timer_;
  std::optional<Scene::Watch> watch_;
  std::atomic<bool> notified_{false};  // woken() was posted
  MemberTag<QueryWork> woken_{*this, &QueryWork::woken};

  std::optional<SnapshotPin> pin_;
  std::optional<ResultColumns> columns_;
  std::unique_ptr<BatchRun> run_;
  Progress progress_ = Progress::kMore;  // result of run_deferred()
  QueryScheduler::TicketPtr ticket_;
  MemberTag<QueryWork> finished_{*this, &QueryWork::finished};
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_QUERY_WORK_H_
