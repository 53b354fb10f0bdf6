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
  Impl(const Link& link, std::shared_ptr<Authorization> authorization, std::string scene,
       const QueryStreamOptions& options)
      : stub_(v1::QueryService::NewStub(link.channel)),
        writer_(options.writer != 0 ? options.writer : random_writer()),
        next_batch_(options.next_batch),
        stream_(*this, std::move(scene),
                {link, options.max_in_flight, options.reconnect, options.patience, std::move(authorization)}) {}

  Stream& stream() { return stream_; }

  void start_call(grpc::ClientContext* context, Stream::Reactor* reactor) override {
    stub_->async()->StreamQueries(context, reactor);
  }
  void number(v1::StreamQueriesRequest& request) override {
    request.set_sequence(++sequence_);
    if (!request.has_update()) return;
    request.mutable_update()->set_writer(writer_);
    request.mutable_update()->set_batch(next_batch_++);
  }
  // Returns the error of a batch without an update, and of a step that was refused as a whole.
  absl::StatusOr<StepResult> outcome_of(v1::StreamQueriesResponse& response) override {
    absl::StatusOr<v1::QueryResult> result = result_of(response);
    if (!result.ok() && !response.has_ack()) return result.status();
    return StepResult{std::move(*response.mutable_ack()), std::move(result)};
  }
  absl::Status answered(const v1::StreamQueriesRequest& request, const absl::StatusOr<StepResult>& outcome,
                        Stream::Items& items, size_t position) override {
    if (outcome.ok() || !request.has_update()) return absl::OkStatus();
    if (!batch_number_is_unused(outcome.status())) return outcome.status();
    --next_batch_;
    for (size_t behind = position; behind < items.size(); ++behind)
      if (items[behind].request->has_update()) --next_batch_;
    stream_.number_again(items, position);
    return absl::OkStatus();
  }

 private:
  const std::unique_ptr<v1::QueryService::StubInterface> stub_;
  const uint64_t writer_;
  uint64_t next_batch_;    // guarded by the stream's lock
  uint64_t sequence_ = 0;  // guarded by the stream's lock
  Stream stream_;          // declared last: its thread uses all members above
};

QueryStream::QueryStream(const Link& link, std::shared_ptr<Authorization> authorization, std::string scene,
                         const QueryStreamOptions& options)
    : impl_(std::make_unique<Impl>(link, std::move(authorization), std::move(scene), options)) {}

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
