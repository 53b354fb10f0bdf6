#include "tests/bench/serving/unary_load.h"

#include "tests/bench/frame/race.h"

namespace locus::bench::serving {
namespace {

class Calls {
 public:
  Calls(const Daemon& daemon, const Batches& batches, size_t under_way)
      : stub_(v1::QueryService::NewStub(daemon.channel())), slots_(under_way) {
    for (const v1::StreamQueriesRequest& message : batches.messages) {
      v1::QueryRequest& request = requests_.emplace_back();
      request.set_scene(message.scene());
      *request.mutable_batch() = message.batch();
    }
  }

  Flood run(double seconds) {
    const double end = wall_seconds() + seconds;
    for (Slot& slot : slots_) start(slot);
    for (size_t alive = slots_.size(); alive > 0;) {
      void* tag = nullptr;
      bool ok = false;
      const auto deadline = std::chrono::system_clock::now() + kSilence;
      if (queue_.AsyncNext(&tag, &ok, deadline) != grpc::CompletionQueue::GOT_EVENT) {
        flood_.failure.Update(absl::DeadlineExceededError("the server keeps silent"));
        for (Slot& slot : slots_) slot.context->TryCancel();
        continue;
      }
      Slot& slot = *static_cast<Slot*>(tag);
      book(slot);
      if (flood_.failure.ok() && wall_seconds() < end)
        start(slot);
      else
        --alive;
    }
    queue_.Shutdown();
    return std::move(flood_);
  }

 private:
  struct Slot {
    std::unique_ptr<grpc::ClientContext> context;
    std::unique_ptr<grpc::ClientAsyncResponseReader<v1::QueryResponse>> reader;
    v1::QueryResponse response;
    grpc::Status status;
    double started = 0;
  };

  void start(Slot& slot) {
    slot.context = std::make_unique<grpc::ClientContext>();
    slot.started = wall_seconds();
    slot.reader = stub_->AsyncQuery(slot.context.get(), requests_[sent_++ % requests_.size()], &queue_);
    slot.reader->Finish(&slot.response, &slot.status, &slot);
  }

  void book(const Slot& slot) {
    if (slot.status.ok())
      ++flood_.answered;
    else if (slot.status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED)
      flood_.refusals.push_back(wall_seconds() - slot.started);
    else
      flood_.failure.Update(failed(slot.status));
  }

  const std::unique_ptr<v1::QueryService::Stub> stub_;
  grpc::CompletionQueue queue_;
  std::vector<v1::QueryRequest> requests_;
  std::vector<Slot> slots_;
  size_t sent_ = 0;
  Flood flood_;
};

}  // namespace

Flood run_unary_load(const Daemon& daemon, const Batches& batches, size_t under_way, double seconds) {
  return Calls(daemon, batches, under_way).run(seconds);
}

}  // namespace locus::bench::serving
