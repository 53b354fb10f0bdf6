#include "client/lib/query_stream.h"

#include <utility>

#include "client/lib/pipelined_stream.h"
#include "client/lib/status.h"
#include "locus/v1/query_service.grpc.pb.h"

namespace locus::client {
namespace {

using Stream = PipelinedStream<v1::StreamQueriesRequest, v1::StreamQueriesResponse, v1::QueryResult>;

}  // namespace

class QueryStream::Impl final : public Stream::Kind {
 public:
  Impl(const Link& link, std::shared_ptr<Authorization> authorization, std::string scene,
       const QueryStreamOptions& options)
      : stub_(v1::QueryService::NewStub(link.channel)),
        stream_(*this, std::move(scene),
                {link, options.max_in_flight, options.reconnect, options.patience, std::move(authorization)}) {}

  Stream& stream() { return stream_; }

  void start_call(grpc::ClientContext* context, Stream::Reactor* reactor) override {
    stub_->async()->StreamQueries(context, reactor);
  }
  void number(v1::StreamQueriesRequest& request) override { request.set_sequence(++sequence_); }
  absl::StatusOr<v1::QueryResult> outcome_of(v1::StreamQueriesResponse& response) override {
    if (response.has_result()) return std::move(*response.mutable_result());
    if (response.has_error()) return to_absl_status(response.error());
    return absl::DataLossError("the server answered a batch with neither a result nor an error");
  }
  absl::Status answered(const absl::StatusOr<v1::QueryResult>&, Stream::Items&, size_t) override {
    return absl::OkStatus();
  }

 private:
  const std::unique_ptr<v1::QueryService::StubInterface> stub_;
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
  return impl_->stream().send(std::move(request), std::move(on_result));
}

std::future<absl::StatusOr<v1::QueryResult>> QueryStream::send(v1::QueryBatch batch) {
  return send_for_future<v1::QueryResult>([&](ResultCallback done) { return send(std::move(batch), std::move(done)); });
}

absl::Status QueryStream::flush() { return impl_->stream().flush(); }
absl::Status QueryStream::close() { return impl_->stream().close(); }

}  // namespace locus::client
