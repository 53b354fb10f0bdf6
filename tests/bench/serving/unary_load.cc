#include "tests/bench/serving/unary_load.h"

#include <limits>
#include <map>

#include "client/lib/retry.h"
#include "client/lib/status.h"
#include "tests/bench/frame/race.h"

namespace locus::bench::serving {
namespace {

constexpr double kComing = 0.05;  // part of the run during which the callers start one by one

// Returns a policy that retries without a limit.
client::RetryPolicy patient() {
  client::RetryPolicy policy;
  policy.max_attempts = std::numeric_limits<int>::max();
  return policy;
}

class Calls {
 public:
  Calls(const Daemon& daemon, const Batches& batches, size_t callers, Again again)
      : daemon_(daemon), again_(again), stub_(v1::QueryService::NewStub(daemon.channel())), slots_(callers) {
    for (const v1::StreamQueriesRequest& message : batches.messages) {
      v1::QueryRequest& request = requests_.emplace_back();
      request.set_scene(message.scene());
      *request.mutable_batch() = message.batch();
    }
  }

  Flood run(double seconds) {
    const double here = process_seconds(), there = daemon_.process().cpu_seconds();
    const double begin = wall_seconds();
    end_ = begin + seconds;
    for (size_t i = 0; i < slots_.size(); ++i)
      waiting_.emplace(begin + kComing * seconds * static_cast<double>(i) / static_cast<double>(slots_.size()),
                       &slots_[i]);
    while (true) {
      start_those_due();
      if (under_way_ == 0 && waiting_.empty()) break;
      take_one();
    }
    flood_.client_seconds = process_seconds() - here;
    flood_.server_seconds = daemon_.process().cpu_seconds() - there;
    queue_.Shutdown();
    return std::move(flood_);
  }

 private:
  struct Slot {
    std::unique_ptr<grpc::ClientContext> context;
    std::unique_ptr<grpc::ClientAsyncResponseReader<v1::QueryResponse>> reader;
    v1::QueryResponse response;
    grpc::Status status;
    client::Backoff backoff{patient()};
    double started = 0;
  };

  bool over() const { return !flood_.failure.ok() || wall_seconds() >= end_; }

  void start_those_due() {
    if (over()) waiting_.clear();
    const double now = wall_seconds();
    while (!waiting_.empty() && waiting_.begin()->first <= now) {
      start(*waiting_.begin()->second);
      waiting_.erase(waiting_.begin());
    }
  }

  void start(Slot& slot) {
    slot.context = std::make_unique<grpc::ClientContext>();
    slot.started = wall_seconds();
    slot.reader = stub_->AsyncQuery(slot.context.get(), requests_[sent_++ % requests_.size()], &queue_);
    slot.reader->Finish(&slot.response, &slot.status, &slot);
    ++under_way_;
  }

  // Processes the next completed call, unless another call must be started first.
  void take_one() {
    const double silence = std::chrono::duration<double>(kSilence).count();
    const double wait = waiting_.empty() ? silence : std::min(waiting_.begin()->first, end_) - wall_seconds();
    void* tag = nullptr;
    bool ok = false;
    const auto deadline =
        std::chrono::system_clock::now() + std::chrono::microseconds(static_cast<int64_t>(1e6 * wait));
    if (queue_.AsyncNext(&tag, &ok, deadline) != grpc::CompletionQueue::GOT_EVENT) {
      if (!waiting_.empty()) return;
      flood_.failure.Update(absl::DeadlineExceededError("the server keeps silent"));
      for (Slot& slot : slots_)
        if (slot.context != nullptr) slot.context->TryCancel();
      return;
    }
    --under_way_;
    Slot& slot = *static_cast<Slot*>(tag);
    const double wait_before_next = book(slot);
    if (over()) return;
    if (wait_before_next > 0)
      waiting_.emplace(wall_seconds() + wait_before_next, &slot);
    else
      start(slot);
  }

  // Counts the result of a completed call. Returns the seconds until the caller's next call.
  double book(Slot& slot) {
    if (slot.status.ok()) {
      ++flood_.answered;
      slot.backoff.reset();
      return 0;
    }
    if (slot.status.error_code() != grpc::StatusCode::RESOURCE_EXHAUSTED) {
      flood_.failure.Update(failed(slot.status));
      return 0;
    }
    flood_.refusals.push_back(wall_seconds() - slot.started);
    if (again_ == Again::kAtOnce) return 0;
    return absl::ToDoubleSeconds(*slot.backoff.after_failure(client::to_absl_status(slot.status)));
  }

  const Daemon& daemon_;
  const Again again_;
  const std::unique_ptr<v1::QueryService::Stub> stub_;
  grpc::CompletionQueue queue_;
  std::vector<v1::QueryRequest> requests_;
  std::vector<Slot> slots_;
  std::multimap<double, Slot*> waiting_;  // callers that wait, by the time of their next call
  size_t under_way_ = 0;
  double end_ = 0;
  size_t sent_ = 0;
  Flood flood_;
};

}  // namespace

Flood run_unary_load(const Daemon& daemon, const Batches& batches, size_t callers, double seconds, Again again) {
  return Calls(daemon, batches, callers, again).run(seconds);
}

}  // namespace locus::bench::serving
