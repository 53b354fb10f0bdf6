#include "server/services/query_work.h"

#include <algorithm>
#include <chrono>
#include <set>
#include <utility>

#include "absl/strings/str_join.h"
#include "core/base/status_macros.h"
#include "core/query/columns.h"
#include "server/convert/convert.h"
#include "server/convert/status.h"
#include "server/observability/log.h"
#include "server/scheduling/clocks.h"
#include "server/services/cluster/cluster_scenes.h"

namespace locus::server {

using std::chrono::steady_clock;

namespace {

// Estimated work, in nanoseconds, below which a query batch runs while its IO loop handles no other event. For a longer
// batch, another thread is woken to handle the loop's events. For a shorter batch, waking that thread would take more
// time than the batch itself.
constexpr uint64_t kShortNanoseconds = 30'000;

}  // namespace

void QueryWork::begin(const std::string& scene, const v1::QueryBatch& batch, v1::QueryResult& result) {
  begin_reading(batch, result);
  if (absl::Status status = read(scene, batch); !status.ok()) return answer(std::move(status));
  until_ = slot_.caller().wait_until(slot_.stream());
  look();
}

void QueryWork::begin_reading(const v1::QueryBatch& batch, v1::QueryResult& result) {
  change({State::kIdle}, State::kReading);
  is_step_ = false;
  ack_bytes_ = 0;
  message_ = &batch;
  result_ = &result;
  result_->Clear();
}

absl::Status QueryWork::prepare(const std::string& scene, const v1::QueryBatch& batch, v1::QueryResult& result) {
  begin_reading(batch, result);
  absl::Status status = read(scene, batch);
  if (!status.ok()) {
    drop();
    return status;
  }
  status = check_step_view();
  if (!status.ok()) cancel();
  return status;
}

absl::Status QueryWork::check_step_view() const {
  if (view_.kind == View::Kind::kExactly)
    return refuse_argument(Reason::kMalformed, "view.exactly", {},
                           "the queries of a step see its update, whose revision is not known yet; leave the view out");
  if (view_.epoch == 0) return absl::OkStatus();
  return scene_->view({View::Kind::kLatest, 0, view_.epoch}, SteadyTime::min()).status();
}

void QueryWork::start(uint64_t revision, uint64_t ack_bytes) {
  is_step_ = true;
  ack_bytes_ = ack_bytes;
  view_.revision = view_.kind == View::Kind::kAtLeast ? std::max(view_.revision, revision) : revision;
  view_.kind = View::Kind::kAtLeast;
  // give_up() had no effect while the update was applied.
  if (absl::Status status = slot_.caller().stop(); !status.ok()) return answer(std::move(status));
  until_ = slot_.caller().wait_until(slot_.stream());
  look();
}

absl::Status QueryWork::read(const std::string& scene, const v1::QueryBatch& batch) {
  ASSIGN_OR_RETURN(scene_, use_scene(host_, slot_.caller(), scene, "scene"));
  ASSIGN_OR_RETURN(QueryBatch queries, to_queries(batch));
  batch_ = std::move(queries);
  view_ = to_view(batch.view());
  RETURN_IF_ERROR(check_batch(batch_));
  return take_quotas();
}

double QueryWork::queries() const {
  double queries = 0;
  for (const QueryBlock& block : batch_.blocks) queries += static_cast<double>(query_count(block));
  return queries;
}

CostEstimates::ListValues QueryWork::list_values() const { return message_->by_list() ? tested_by_list(**pin_) : 0; }

void QueryWork::cancel() {
  slot_.caller().give_back_quota(QuotaKind::kQueries, queries());
  drop();
}

absl::Status QueryWork::take_quotas() const {
  // With amount 0, this fails only while the quota is overdrawn. It comes first, because a refused batch takes nothing.
  RETURN_IF_ERROR(slot_.caller().take_quota(QuotaKind::kWork, 0));
  return slot_.caller().take_quota(QuotaKind::kQueries, queries());
}

// The end of a drain is no UNAVAILABLE error for a step, whose ack must be sent: that error means that nothing was
// changed.
void QueryWork::answer(absl::Status status) {
  drop();
  if (is_step_ && absl::IsUnavailable(status) && host_.drain.draining())
    status = absl::DeadlineExceededError(
        "the server is shutting down before it answered the queries of the step; the update was applied");
  slot_.answered(std::move(status));
}

// Charges the caller's quota for the work of the queries even if they failed or were given up.
void QueryWork::drop() {
  ticket_.reset();
  if (run_ != nullptr) slot_.caller().charge_quota(QuotaKind::kWork, static_cast<double>(run_->work_done()));
  run_.reset();
  instances_claim_.release();
  pin_.reset();
  scene_.reset();
  change({State::kReading, State::kParked, State::kDeferred, State::kQueued}, State::kIdle);
}

void QueryWork::look() {
  absl::StatusOr<SnapshotPin> pin = scene_->pin(view_, SteadyTime::min());
  if (pin.ok()) {
    pin_.emplace(*std::move(pin));
    if (absl::Status status = check_age(); !status.ok()) return answer(std::move(status));
    return run();
  }
  const bool may_come = pin.status().code() == absl::StatusCode::kDeadlineExceeded && steady_clock::now() < until_;
  if (!may_come) return answer(pin.status());
  if (host_.drain.draining()) return answer(no_longer());
  wait();
}

// Checks the lease of the scene's leader after the revision was pinned: an update that another leader acknowledges
// later is later than this answer.
absl::Status QueryWork::check_age() {
  age_ms_ = 0;
  if (host_.cluster == nullptr) return absl::OkStatus();
  ASSIGN_OR_RETURN(age_ms_, host_.cluster->check_view(*scene_, message_->view()));
  return absl::OkStatus();
}

// Returns the error for a query batch that stops waiting for its revision, because the call has ended or because the
// server drains and accepts no more updates. When the server drains, a unary call gets the draining error. A message of
// a stream gets DEADLINE_EXCEEDED, because the draining error is the status of the whole stream, which ends only after
// all its messages are answered. A step gets the same, because the draining error means that nothing was changed.
absl::Status QueryWork::no_longer() const {
  RETURN_IF_ERROR(slot_.caller().stop());
  if (!slot_.stream() && !is_step_) return draining();
  return absl::DeadlineExceededError("the server is shutting down before the scene reached the revision");
}

void QueryWork::wait() {
  change({State::kReading}, State::kParked);
  notified_.store(false);
  timer_ = slot_.io().at(until_, [this] {
    timer_.reset();
    if (end_wait()) resume();
  });
  watch_.emplace(*scene_, view_.revision, [this, &io = slot_.io()] {
    notified_.store(true);
    io.post(woken_);
  });
}

bool QueryWork::end_wait() {
  if (timer_) slot_.io().cancel(*timer_);
  timer_.reset();
  watch_.reset();
  return !notified_.load();
}

void QueryWork::woken(bool) {
  end_wait();
  resume();
}

void QueryWork::resume() {
  change({State::kParked}, State::kReading);
  look();
}

void QueryWork::give_up() {
  if (state_ == State::kParked && end_wait()) return answer(no_longer());
  if (state_ != State::kQueued || slot_.caller().stop().ok() || !host_.scheduler.withdraw(*ticket_)) return;
  answer(slot_.caller().stop());
}

// Runs the pinned batch. The memory of the answer is claimed only here, so that parked batches claim no memory for
// answers.
void QueryWork::run() {
  if (absl::Status status = slot_.claim_answer(max_encoded_reply_bytes(batch_) + ack_bytes_); !status.ok())
    return answer(std::move(status));
  started_ = steady_clock::now();
  RunOptions options;
  options.stop = [this] {
    absl::Status revoked = pin_->status();
    return revoked.ok() ? slot_.caller().stop() : revoked;
  };
  // Measure processor time, not elapsed time. Otherwise the time that a thread waits for a core would raise the
  // estimates of work, and later batches would be queued needlessly.
  options.work_clock = &thread_nanoseconds;
  options.clock = &steady_nanoseconds;
  options.brute_force = message_->by_list();
  columns_.emplace(*result_, batch_.blocks.size());
  absl::StatusOr<std::unique_ptr<BatchRun>> run = BatchRun::prepare(**pin_, batch_, std::move(options), *columns_);
  if (!run.ok()) return answer(run.status());
  run_ = *std::move(run);
  if (absl::Status status = claim_instances(); !status.ok()) return answer(std::move(status));
  const uint64_t cost = host_.costs.nanoseconds((*pin_)->epoch, batch_, list_values());
  if (!host_.scheduler.runs_inline(cost)) return submit(cost);
  change({State::kReading}, State::kDeferred);
  slot_.io().defer(*this, cost < kShortNanoseconds ? TaskLength::kShort : TaskLength::kLong);
}

absl::Status QueryWork::claim_instances() {
  const uint64_t bytes = run_->interpolated_bytes();
  if (bytes == 0) return absl::OkStatus();
  ASSIGN_OR_RETURN(instances_claim_, slot_.caller().claim(MemoryLine::kReplies, "blocks", bytes));
  return absl::OkStatus();
}

void QueryWork::run_deferred() { progress_ = host_.scheduler.run_inline(*this); }

void QueryWork::on_deferred_done() {
  if (progress_ == Progress::kDone) return finished(true);
  // Use the time that run_inline() has already taken as the estimate for the rest of the batch.
  submit(host_.scheduler.options().inline_nanoseconds);
}

void QueryWork::submit(uint64_t nanoseconds) {
  change({State::kReading, State::kDeferred}, State::kQueued);
  absl::StatusOr<QueryScheduler::TicketPtr> ticket = host_.scheduler.submit(*this, slot_.client(), nanoseconds);
  if (!ticket.ok()) return answer(ticket.status());
  ticket_ = *std::move(ticket);
}

void QueryWork::done() { slot_.io().post(finished_); }

void QueryWork::finished(bool) {
  LOCUS_DCHECK(state_ == State::kDeferred || state_ == State::kQueued);
  if (absl::Status status = run_->status(); !status.ok()) return answer(std::move(status));
  result_->set_epoch((*pin_)->epoch);
  result_->set_revision((*pin_)->revision);
  result_->set_tick((*pin_)->tick);
  result_->set_age_ms(age_ms_);
  for (size_t i = 0; i < batch_.blocks.size(); ++i) learn(batch_.blocks[i], run_->cost(i));
  if (message_->explain()) explain();
  note_if_slow();
  answer(absl::OkStatus());
}

void QueryWork::learn(const QueryBlock& block, const QueryCost& cost) {
  const uint64_t work = cost.work.nodes + cost.work.cells + cost.work.tests;
  host_.costs.learn((*pin_)->epoch, block, cost.nanoseconds, list_values(), work);
  host_.metrics.record_block(block_kind(block), query_count(block), cost.nanoseconds, cost.work);
}

void QueryWork::explain() {
  const QueryCost total = run_->cost();
  *result_->mutable_work() = to_proto(total.work, total.nanoseconds);
  for (size_t i = 0; i < batch_.blocks.size(); ++i)
    *result_->mutable_blocks(static_cast<int>(i))->mutable_work() =
        to_proto(run_->cost(i).work, run_->cost(i).nanoseconds);
}

void QueryWork::note_if_slow() {
  const uint64_t nanoseconds = nanoseconds_since(started_);
  SlowQueries& slow = host_.slow_queries;
  if (!slow.is_slow(nanoseconds)) return;
  const QueryCost cost = run_->cost();
  SlowQuery query;
  query.rpc = rpc_name(rpc_);
  query.scene = scene_->name();
  query.revision = (*pin_)->revision;
  query.nanoseconds = nanoseconds;
  query.work_nanoseconds = cost.nanoseconds;
  query.work = cost.work;
  std::set<absl::string_view> kinds;
  for (const QueryBlock& block : batch_.blocks) {
    query.queries += query_count(block);
    kinds.insert(block_kind_name(block_kind(block)));
  }
  query.kinds = absl::StrJoin(kinds, ",");
  const LogScope scope(slot_.caller().trace());
  slow.record(query, steady_clock::now());
}

}  // namespace locus::server
