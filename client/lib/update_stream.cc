#include "client/lib/update_stream.h"

#include <mutex>
#include <utility>

#include "client/lib/pipelined_stream.h"
#include "client/lib/status.h"
#include "client/lib/writer.h"
#include "locus/v1/update_service.grpc.pb.h"

namespace locus::client {
namespace {

using UpdatePipeline = PipelinedStream<v1::StreamUpdatesRequest, v1::StreamUpdatesResponse, v1::UpdateAck>;

}  // namespace

class UpdateStream::Impl final : public UpdatePipeline::Kind {
 public:
  Impl(std::shared_ptr<Router> router, std::string scene, const UpdateStreamOptions& options)
      : lane_(options.lane),
        numbers_(options.writer, options.next_batch, lease_ms_of(options.lease)),
        stream_(*this, std::move(scene),
                {std::move(router), options.lane, options.max_in_flight, options.reconnect, options.patience,
                 renewal_of(options.lease)}) {}

  UpdatePipeline& stream() { return stream_; }
  uint64_t writer() const { return numbers_.writer(); }
  std::optional<Revision> last_ack() const {
    std::lock_guard lock(ack_mutex_);
    return last_ack_;
  }

  void start_call(const ServerLinks& server, grpc::ClientContext* context, UpdatePipeline::Reactor* reactor) override {
    stub_ = v1::UpdateService::NewStub(server.link_of(lane_).channel);
    stub_->async()->StreamUpdates(context, reactor);
  }

  void number(v1::StreamUpdatesRequest& request) override { numbers_.number(*request.mutable_batch()); }

  absl::Status held(v1::StreamUpdatesResponse& response) override {
    const absl::StatusOr<v1::UpdateAck> ack = outcome_of(response);
    if (ack.ok() && !ack->pending()) {
      return absl::UnimplementedError(
          "the server does not hold messages (`continues`): it applied one that is a part of a batch");
    }
    return ack.status();
  }

  Revision revision_of(const v1::UpdateAck& ack) const override { return {ack.epoch(), ack.revision()}; }

  absl::StatusOr<v1::UpdateAck> outcome_of(v1::StreamUpdatesResponse& response) override {
    if (response.has_ack()) return std::move(*response.mutable_ack());
    if (response.has_error()) return to_absl_status(response.error());
    return absl::DataLossError("the server answered a batch with neither an ack nor an error");
  }

  bool goes_again(const UpdatePipeline::Item& item, const absl::StatusOr<v1::UpdateAck>& outcome) override {
    return !outcome.ok() && numbers_.closes_gap(item.request->batch().batch(), outcome.status());
  }

  absl::Status answered(const UpdatePipeline::Item& item, absl::StatusOr<v1::UpdateAck>& outcome,
                        UpdatePipeline::Items& items, size_t position) override {
    const uint64_t batch = item.request->batch().batch();
    if (outcome.ok()) {
      if (absl::Status status = numbers_.acked(batch, outcome->duplicate(), item.sent_before); !status.ok()) {
        outcome = status;
        return status;
      }
      std::lock_guard lock(ack_mutex_);
      last_ack_ = Revision{outcome->epoch(), outcome->revision()};
      return absl::OkStatus();
    }
    return handle_refusal(numbers_, batch, item.sent_before, outcome, [&] { stream_.number_again(items, position); });
  }

 private:
  const Lane lane_;
  std::unique_ptr<v1::UpdateService::StubInterface> stub_;  // of the current call
  BatchNumbers numbers_;                                    // guarded by the stream's lock
  mutable std::mutex ack_mutex_;
  std::optional<Revision> last_ack_;  // guarded by ack_mutex_
  UpdatePipeline stream_;             // declared last: its thread uses all members above
};

UpdateStream::UpdateStream(std::shared_ptr<Router> router, std::string scene, const UpdateStreamOptions& options)
    : impl_(std::make_unique<Impl>(std::move(router), std::move(scene), options)) {}

UpdateStream::~UpdateStream() = default;

absl::Status UpdateStream::send(v1::UpdateBatch batch, AckCallback on_ack) {
  v1::StreamUpdatesRequest request;
  *request.mutable_batch() = std::move(batch);
  return impl_->stream().send(std::move(request), std::move(on_ack));
}

std::future<absl::StatusOr<v1::UpdateAck>> UpdateStream::send(v1::UpdateBatch batch) {
  return send_for_future<v1::UpdateAck>([&](AckCallback done) { return send(std::move(batch), std::move(done)); });
}

absl::Status UpdateStream::send_together(std::vector<v1::UpdateBatch> batches, AckCallback on_ack) {
  if (batches.empty()) return absl::InvalidArgumentError("there are no batches to send together");
  v1::StreamUpdatesRequest last;
  *last.mutable_batch() = std::move(batches.back());
  batches.pop_back();
  std::vector<v1::StreamUpdatesRequest> held(batches.size());
  for (size_t i = 0; i < held.size(); ++i) {
    *held[i].mutable_batch() = std::move(batches[i]);
    held[i].mutable_batch()->set_continues(true);
  }
  return impl_->stream().send(std::move(last), std::move(on_ack), std::move(held));
}

std::future<absl::StatusOr<v1::UpdateAck>> UpdateStream::send_together(std::vector<v1::UpdateBatch> batches) {
  return send_for_future<v1::UpdateAck>(
      [&](AckCallback done) { return send_together(std::move(batches), std::move(done)); });
}

absl::Status UpdateStream::flush() { return impl_->stream().flush(); }
absl::Status UpdateStream::close() { return impl_->stream().close(); }
std::optional<Revision> UpdateStream::last_ack() const { return impl_->last_ack(); }
uint64_t UpdateStream::writer() const { return impl_->writer(); }

}  // namespace locus::client
