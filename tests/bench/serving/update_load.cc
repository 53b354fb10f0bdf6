#include "tests/bench/serving/update_load.h"

namespace locus::bench::serving {

UpdateLoad::UpdateLoad(const Daemon& daemon, std::vector<v1::StreamUpdatesRequest>& messages, size_t window,
                       Expect expect)
    : messages_(messages), window_(window), expect_(expect) {
  const auto stub = std::shared_ptr(v1::UpdateService::NewStub(daemon.channel()));
  stream_ = std::make_unique<Load>([stub](grpc::ClientContext* context, grpc::CompletionQueue* queue, void* tag) {
    return stub->AsyncStreamUpdates(context, queue, tag);
  });
}

void UpdateLoad::run(size_t passes) {
  size_t sent = 0, wrong = 0;
  const auto next = [&](uint64_t&) {
    const size_t at = sent++;
    return at < passes * messages_.size() ? &messages_[at % messages_.size()] : nullptr;
  };
  const auto reply = [&](uint64_t, const v1::StreamUpdatesResponse& response, double) {
    const v1::UpdateAck& ack = response.ack();
    if (!response.has_ack() || ack.refused() != 0 || ack.duplicate() != (expect_ == Expect::kDuplicate)) ++wrong;
    ack_bytes_ = response.ByteSizeLong();
  };
  status_.Update(stream_->run(window_, next, reply));
  if (wrong != 0) status_.Update(absl::DataLossError(absl::StrCat(wrong, " acks were not what they had to be")));
}

}  // namespace locus::bench::serving
