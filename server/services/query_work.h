// Work on one query batch, from its message to the columns of its reply: converts and checks the batch, pins the
// revision that it names, runs the queries and answers. The work never blocks the IO loop: a batch whose revision is
// not published yet is parked, short work is deferred until the handler has returned, and long work is submitted to the
// query scheduler.
//
// A step (step_work.h) calls prepare(), which is read(), applies its update, and then calls start(), which continues
// with look(); begin() does both at once.
//
//   READING
//   begin() --> read() --error--------------------------------------------> answer()
//                 |
//                 v      not published yet, and no drain
//               look() ------------------------------> PARKED --give_up()-> answer()
//                 |  ^                                    |
//                 |  +--- timer, or woken() by the watch -+
//                 +--error: epoch, range, deadline, deleted, draining -----> answer()
//                 | pinned
//                 v
//               run() --no memory, or error of BatchRun::prepare() --------> answer()
//                 |  \ estimate >= inline_nanoseconds
//                 |   \-----------------------+
//                 v                           v
//              DEFERRED --not finished--> submit() --queue is full --------> answer()
//                 |                           |
//                 | finished                  v
//                 |                        QUEUED --give_up(), withdrawn --> answer()
//                 |                           | all pool threads have left it
//                 v                           v
//              finished() <---- post ------ done()
//                 |
//                 +--> columns, metrics, or the error of the run ----------> answer()
//
// The words in capitals are values of State. answer() frees the work's data, calls CallSlot::answered() once and sets
// the state to IDLE. give_up() has an effect in PARKED and QUEUED only: in the other states the running code checks
// Caller::stop() itself.
//
// Threads: all members run on the call's IO loop, except three. run_deferred() runs on a thread of the loop, without
// the loop's lock, and calls work() there. After submit(), work() runs on several pool threads at the same time, and
// then done() on one of them.
#ifndef LOCUS_SERVER_SERVICES_QUERY_WORK_H_
#define LOCUS_SERVER_SERVICES_QUERY_WORK_H_

#include <algorithm>
#include <atomic>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>

#include "core/base/check.h"
#include "core/query/query_batch.h"
#include "core/query/run/batch_run.h"
#include "core/scene/registry.h"
#include "locus/v1/query_service.pb.h"
#include "server/convert/result_columns.h"
#include "server/host/host.h"
#include "server/rpc/call.h"
#include "server/rpc/call_slot.h"
#include "server/rpc/io_threads.h"
#include "server/scheduling/query_scheduler.h"
#include "server/services/scene_access.h"

namespace locus::server {

class QueryWork final : private QueryJob, private DeferredTask {
 public:
  // `rpc` is the rpc that is named in the log of slow queries.
  QueryWork(Host& host, CallSlot& slot, Rpc rpc) : host_(host), slot_(slot), rpc_(rpc) {}

  // Begins the work. `batch` and `result` are borrowed until the slot is answered.
  void begin(const std::string& scene, const v1::QueryBatch& batch, v1::QueryResult& result);

  // Checks the batch of a step, before its update is applied. Returns every error that the batch's form and values
  // have, and FAILED_PRECONDITION if its view names another epoch; the work has then ended and the slot is not
  // answered. Otherwise start() or cancel() must follow. `batch` and `result` are borrowed until then.
  absl::Status prepare(const std::string& scene, const v1::QueryBatch& batch, v1::QueryResult& result);
  // Answers the prepared batch at `revision`, at which the step's update is visible, or a later revision. `ack_bytes`
  // is the size of the step's ack, which is part of the same answer.
  void start(uint64_t revision, uint64_t ack_bytes);
  // Ends the work without answering the slot, frees its data, and gives back the quota of the queries, which do not
  // run. Call it only after prepare(), instead of start().
  void cancel();
  // Makes the work answer soon: ends the wait for a revision, and withdraws a queued run if the caller has given up. A
  // run in progress is not interrupted here, because it polls Caller::stop() itself.
  void give_up();

 private:
  enum class State : uint8_t { kIdle, kReading, kParked, kDeferred, kQueued };

  // Changes the state, which must be one of `from`.
  void change([[maybe_unused]] std::initializer_list<State> from, State to) {
    LOCUS_DCHECK(std::find(from.begin(), from.end(), state_) != from.end());
    state_ = to;
  }
  absl::Status take_quotas() const;
  // Returns the number of queries of the batch, as an amount of a quota.
  double queries() const;
  // Returns the number of values that each query of a batch by_list tests; 0 for other batches. Precondition: pinned.
  CostEstimates::ListValues list_values() const;
  // Refuses a view that could not contain the update of a step.
  absl::Status check_step_view() const;
  void begin_reading(const v1::QueryBatch& batch, v1::QueryResult& result);
  absl::Status read(const std::string& scene, const v1::QueryBatch& batch);
  void answer(absl::Status status);
  // Ends the work and frees its data.
  void drop();

  // Pins the revision named by the view, then calls run(), or parks the batch until that revision is published.
  void look();
  void wait();
  // Removes the timer and the watch. Returns true if the wait is over. Returns false if woken() was already posted: the
  // state then stays PARKED until woken() runs.
  bool end_wait();
  void woken(bool);
  void resume();
  // Returns the status with which a parked batch is answered when the wait for its revision is given up.
  absl::Status no_longer() const;
  // Sets age_ms_, and returns NO_LEADER if the view demands a younger answer.
  absl::Status check_age();

  void run();
  // Claims memory for the instances that the queries interpolate between ticks.
  absl::Status claim_instances();
  // Works on the batch for about SchedulerOptions::inline_nanoseconds, without the loop's lock.
  void run_deferred() override;
  void on_deferred_done() override;
  // Submits the batch, or the unfinished part of it, to the query scheduler; `nanoseconds` is its estimated work.
  void submit(uint64_t nanoseconds);
  Progress work(uint64_t nanoseconds) override { return run_->work(nanoseconds); }
  void done() override;
  void finished(bool);
  void learn(const QueryBlock& block, const QueryCost& cost);
  void explain();
  void note_if_slow();

  Host& host_;
  CallSlot& slot_;
  const Rpc rpc_;
  State state_ = State::kIdle;
  const v1::QueryBatch* message_ = nullptr;
  v1::QueryResult* result_ = nullptr;
  UsedScene scene_;
  View view_;
  QueryBatch batch_;
  bool is_step_ = false;    // the answer contains the ack of an applied update
  uint64_t ack_bytes_ = 0;  // size of that ack
  uint32_t age_ms_ = 0;     // QueryResult.age_ms
  SteadyTime until_;
  SteadyTime started_;  // time at which run() began, which is after the wait for a revision

  // Used while the batch is parked.
  std::optional<IoLoop::Timers::iterator> timer_;
  std::optional<Scene::Watch> watch_;
  std::atomic<bool> notified_{false};  // whether woken() was posted
  MemberTag<QueryWork> woken_{*this, &QueryWork::woken};

  std::optional<SnapshotPin> pin_;
  std::optional<ResultColumns> columns_;
  CallMemory instances_claim_;  // memory of the instances that the queries interpolate between ticks
  std::unique_ptr<BatchRun> run_;
  Progress progress_ = Progress::kMore;  // result of run_deferred()
  QueryScheduler::TicketPtr ticket_;
  MemberTag<QueryWork> finished_{*this, &QueryWork::finished};
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_QUERY_WORK_H_
