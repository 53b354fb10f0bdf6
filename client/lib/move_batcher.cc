#include "client/lib/move_batcher.h"

#include <utility>

#include "client/lib/gatherer.h"
#include "client/lib/update_builder.h"

namespace locus::client {

class MoveBatcher::Impl {
 public:
  Impl(std::unique_ptr<UpdateStream> stream, const GatherLimits& limits, AckCallback on_ack)
      : stream_(std::move(stream)),
        on_ack_(std::move(on_ack)),
        gatherer_(limits, [this](UpdateBuilder moves) { send(std::move(moves)); }) {}

  Gatherer<UpdateBuilder>& gatherer() { return gatherer_; }
  absl::Status flush() {
    gatherer_.flush();
    return stream_->flush();
  }

 private:
  void send(UpdateBuilder moves) {
    const auto notify = [this](const absl::StatusOr<v1::UpdateAck>& ack) {
      if (on_ack_) on_ack_(ack);
    };
    const absl::Status sent = stream_->send(moves.build(), notify);
    if (!sent.ok()) notify(sent);
  }

  const std::unique_ptr<UpdateStream> stream_;
  const AckCallback on_ack_;
  Gatherer<UpdateBuilder> gatherer_;  // declared last: its thread uses all members above
};

MoveBatcher::MoveBatcher(std::unique_ptr<UpdateStream> stream, const GatherLimits& limits, AckCallback on_ack)
    : impl_(std::make_unique<Impl>(std::move(stream), limits, std::move(on_ack))) {}

MoveBatcher::~MoveBatcher() { flush().IgnoreError(); }

void MoveBatcher::move(uint64_t id, const Position& position, const std::optional<Rotation>& rotation) {
  impl_->gatherer().add([&](UpdateBuilder& moves) { moves.move(id, position, rotation); });
}

absl::Status MoveBatcher::flush() { return impl_->flush(); }

}  // namespace locus::client
