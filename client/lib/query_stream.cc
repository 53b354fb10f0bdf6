#include "client/lib/query_stream.h"

#include <cstdint>
#include <utility>

#include "client/lib/pipelined_stream.h"
#include "client/lib/status.h"
#include "client/lib/writer.h"
#include "locus/v1/query_service.grpc.pb.h"

namespace locus::client {
namespace {

using Stream = PipelinedStream<v1::StreamQueriesRequest, v1::StreamQueriesResponse, StepResult>;

absl::StatusOr<v1::QueryResult> result_of(v1::StreamQueriesResponse& response) {
  if (response.has_result()) return std::move(*response.mutable_result());
  if (response.has_error()) return to_absl_status(response.error());
  return absl::DataLossError("the server answered a batch with neither a result nor an error");
}

}  // namespace

class QueryStream::Impl final : public Stream::Kind {
 public:
  Impl(std::shared_ptr<Router> router, std::string scene, const QueryStreamOptions& options)
      : lane_(options.lane),
        numbers_(options.writer, options.next_batch, lease_ms_of(options.lease)),
        stream_(*this, std::move(scene),
                {std::move(router), options.lane, options.max_in_flight, options.reconnect, options.patience,
                 renewal_of(options.lease)}) {}

  Stream& stream() { return stream_; }

  void start_call(const ServerLinks& server, grpc::ClientContext* context, Stream::Reactor* reactor) override {
    stub_ = v1::QueryService::NewStub(server.link_of(lane_).channel);
    stub_->async()->StreamQueries(context, reactor);
  }
  void number(v1::StreamQueriesRequest& request) override {
    if (request.has_update()) numbers_.number(*request.mutable_update());
  }
  v1::StreamQueriesRequest renewal() override {
    v1::StreamQueriesRequest request;
    request.mutable_update();
    return request;
  }
  bool renews(const v1::StreamQueriesRequest& request) const override { return request.has_update(); }
  v1::View* view_of(v1::StreamQueriesRequest& request) override {
    return request.has_update() ? nullptr : request.mutable_batch()->mutable_view();
  }
  Revision revision_of(const StepResult& step) const override {
    if (step.ack.revision() != 0 || !step.result.ok()) return {step.ack.epoch(), step.ack.revision()};
    return {step.result->epoch(), step.result->revision()};
  }
  // Returns the error of a batch without an update, and of a step that was refused as a whole.
  absl::StatusOr<StepResult> outcome_of(v1::StreamQueriesResponse& response) override {
    absl::StatusOr<v1::QueryResult> result = result_of(response);
    if (!result.ok() && !response.has_ack()) return result.status();
    return StepResult{std::move(*response.mutable_ack()), std::move(result)};
  }
  bool goes_again(const Stream::Item& item, const absl::StatusOr<StepResult>& outcome) override {
    return !outcome.ok() && item.request->has_update() &&
           numbers_.closes_gap(item.request->update().batch(), outcome.status());
  }
  absl::Status answered(const Stream::Item& item, absl::StatusOr<StepResult>& outcome, Stream::Items& items,
                        size_t position) override {
    if (!item.request->has_update()) return absl::OkStatus();
    const uint64_t batch = item.request->update().batch();
    if (outcome.ok()) {
      const absl::Status acked = numbers_.acked(batch, outcome->ack.duplicate(), item.sent_before);
      if (!acked.ok()) outcome = acked;
      return acked;
    }
    return handle_refusal(numbers_, batch, item.sent_before, outcome, [&] { stream_.number_again(items, position); });
  }

 private:
  const Lane lane_;
  std::unique_ptr<v1::QueryService::StubInterface> stub_;  // of the current call
  BatchNumbers numbers_;                                   // guarded by the stream's lock
  Stream stream_;                                          // declared last: its thread uses all members above
};

QueryStream::QueryStream(std::shared_ptr<Router> router, std::string scene, const QueryStreamOptions& options)
    : impl_(std::make_unique<Impl>(std::move(router), std::move(scene), options)) {}

QueryStream::~QueryStream() = default;

absl::Status QueryStream::send(v1::QueryBatch batch, ResultCallback on_result) {
  v1::StreamQueriesRequest request;
  *request.mutable_batch() = std::move(batch);
  return impl_->stream().send(std::move(request), [on_result = std::move(on_result)](absl::StatusOr<StepResult> step) {
    on_result(step.ok() ? std::move(step->result) : step.status());
  });
}

std::future<absl::StatusOr<v1::QueryResult>> QueryStream::send(v1::QueryBatch batch) {
  return send_for_future<v1::QueryResult>([&](ResultCallback done) { return send(std::move(batch), std::move(done)); });
}

absl::Status QueryStream::step(v1::UpdateBatch update, v1::QueryBatch queries, StepCallback on_result) {
  v1::StreamQueriesRequest request;
  *request.mutable_update() = std::move(update);
  *request.mutable_batch() = std::move(queries);
  return impl_->stream().send(std::move(request), std::move(on_result));
}

std::future<absl::StatusOr<StepResult>> QueryStream::step(v1::UpdateBatch update, v1::QueryBatch queries) {
  return send_for_future<StepResult>(
      [&](StepCallback done) { return step(std::move(update), std::move(queries), std::move(done)); });
}

absl::Status QueryStream::flush() { return impl_->stream().flush(); }
absl::Status QueryStream::close() { return impl_->stream().close(); }

}  // namespace locus::client
