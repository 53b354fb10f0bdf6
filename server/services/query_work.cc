#include "server/services/query_work.h"

#include <chrono>
#include <set>
#include <utility>

#include "absl/strings/str_join.h"
#include "core/base/status_macros.h"
#include "server/convert/convert.h"
#include "server/convert/status.h"
#include "server/observability/log.h"
#include "server/scheduling/clocks.h"

namespace locus::server {

using std::chrono::steady_clock;

namespace {

// Estimated work below which a query batch does not hand the lead of its IO loop to another thread, because waking that
// thread to wait for events would cost more.
constexpr uint64_t kShortNanoseconds = 30'000;

}  // namespace

void QueryWork::begin(const std::string& scene, const v1::QueryBatch& batch, v1::QueryResult& result) {
  message_ = &batch;
  result_ = &result;
  result_->Clear();
  if (absl::Status status = read(scene, batch); !status.ok()) return answer(std::move(status));
  until_ = slot_.caller().wait_until(slot_.stream());
  look();
}

absl::Status QueryWork::read(const std::string& scene, const v1::QueryBatch& batch) {
  ASSIGN_OR_RETURN(ScenePtr found, find_scene(slot_.caller(), scene, "scene"));
  scene_ = std::move(found);
  ASSIGN_OR_RETURN(QueryBatch queries, to_queries(batch));
  batch_ = std::move(queries);
  view_ = to_view(batch.view());
  return check_batch(batch_);
}

void QueryWork::answer(absl::Status status) {
  ticket_.reset();
  run_.reset();
  pin_.reset();
  scene_.reset();
  slot_.answered(std::move(status));
}

void QueryWork::look() {
  absl::StatusOr<SnapshotPin> pin = scene_->pin(view_, SteadyTime::min());
  if (pin.ok()) {
    pin_.emplace(*std::move(pin));
    return run();
  }
  const bool may_come = pin.status().code() == absl::StatusCode::kDeadlineExceeded && steady_clock::now() < until_;
  if (!may_come) return answer(pin.status());
  if (slot_.host().drain.draining()) return answer(no_longer());
  wait();
}

// Returns the error for a batch whose revision will not be published any more, because the call has ended or because a
// draining server accepts no updates. A draining server ends a stream only after all its messages are answered, so
// there each message gets an error of its own.
absl::Status QueryWork::no_longer() const {
  RETURN_IF_ERROR(slot_.caller().stop());
  if (!slot_.stream()) return draining();
  return absl::DeadlineExceededError("the server is shutting down before the scene reached the revision");
}

void QueryWork::wait() {
  notified_.store(false);
  timer_ = slot_.io().at(until_, [this] {
    timer_.reset();
    if (end_wait()) look();
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
  look();
}

void QueryWork::give_up() {
  if (watch_ && end_wait()) return answer(no_longer());
  if (!ticket_ || slot_.caller().stop().ok() || !slot_.host().scheduler.withdraw(*ticket_)) return;
  answer(slot_.caller().stop());
}

void QueryWork::run() {
  started_ = steady_clock::now();
  RunOptions options;
  options.stop = [this] {
    absl::Status revoked = pin_->status();
    return revoked.ok() ? slot_.caller().stop() : revoked;
  };
  // Measure processor time, not elapsed time. Otherwise a thread that waits for a core would learn estimates that are
  // too high, and later batches would be queued needlessly.
  options.work_clock = &thread_nanoseconds;
  options.clock = &steady_nanoseconds;
  columns_.emplace(*result_, batch_.blocks.size());
  absl::StatusOr<std::unique_ptr<BatchRun>> run = BatchRun::prepare(**pin_, batch_, std::move(options), *columns_);
  if (!run.ok()) return answer(run.status());
  run_ = *std::move(run);
  const uint64_t cost = slot_.host().costs.nanoseconds((*pin_)->epoch, batch_);
  if (!slot_.host().scheduler.runs_inline(cost)) return submit(cost);
  slot_.io().defer(*this, cost < kShortNanoseconds ? TaskLength::kShort : TaskLength::kLong);
}

void QueryWork::run_deferred() { progress_ = slot_.host().scheduler.run_inline(*this); }

void QueryWork::on_deferred_done() {
  if (progress_ == Progress::kDone) return finished(true);
  submit(slot_.host().scheduler.options().inline_nanoseconds);  // run_inline() has used up this budget already
}

void QueryWork::submit(uint64_t nanoseconds) {
  absl::StatusOr<QueryScheduler::TicketPtr> ticket = slot_.host().scheduler.submit(*this, slot_.client(), nanoseconds);
  if (!ticket.ok()) return answer(ticket.status());
  ticket_ = *std::move(ticket);
}

void QueryWork::done() { slot_.io().post(finished_); }

void QueryWork::finished(bool) {
  if (absl::Status status = run_->status(); !status.ok()) return answer(std::move(status));
  result_->set_epoch((*pin_)->epoch);
  result_->set_revision((*pin_)->revision);
  result_->set_tick((*pin_)->tick);
  for (size_t i = 0; i < batch_.blocks.size(); ++i) learn(batch_.blocks[i], run_->cost(i));
  if (message_->explain()) explain();
  note_if_slow();
  answer(absl::OkStatus());
}

void QueryWork::learn(const QueryBlock& block, const QueryCost& cost) {
  slot_.host().costs.learn((*pin_)->epoch, block, cost.nanoseconds);
  slot_.host().metrics.record_block(block_kind(block), query_count(block), cost.nanoseconds, cost.work);
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
  SlowQueries& slow = slot_.host().slow_queries;
  if (!slow.is_slow(nanoseconds)) return;
  const QueryCost cost = run_->cost();
  SlowQuery query;
  query.rpc = rpc_name(slot_.stream() ? Rpc::kStreamQueries : Rpc::kQuery);
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
