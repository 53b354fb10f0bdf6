#include "server/service/update_service.h"

#include "server/service/call.h"
#include "server/service/convert.h"
#include "server/service/stream_loop.h"

namespace locus::server {
namespace {

using Stream = BlockingStream<v1::StreamUpdatesRequest, v1::StreamUpdatesResponse>;

// Room for what the batch needs while it is applied. A batch that inserts may be refused; others only change what is
// there, or make room themselves.
absl::StatusOr<MemoryBudget::Claim> make_room(Host& host, const UpdateBatch& batch) {
  const UpdateCost cost = cost_of(batch);
  if (cost.inserts) return host.memory.claim("inserts", cost.bytes);
  return host.memory.claim_anyway(cost.bytes);
}

absl::StatusOr<UpdateAck> apply_in_time(const Caller& caller, Scene& scene, const UpdateBatch& batch) {
  while (true) {
    if (absl::Status status = wait_for_readers(scene, [&caller] { return caller.stop(); }); !status.ok()) return status;
    absl::StatusOr<UpdateAck> ack = scene.apply(batch, SteadyTime::min());
    // Another batch was faster, and now there is something to wait for again.
    if (ack.status().code() != absl::StatusCode::kDeadlineExceeded) return ack;
  }
}

absl::Status apply(Host& host, const Caller& caller, const std::string& name, const v1::UpdateBatch& batch,
                   v1::UpdateAck* out) {
  const absl::StatusOr<ScenePtr> scene = find_scene(caller, name, "scene");
  if (!scene.ok()) return scene.status();
  const absl::StatusOr<UpdateBatch> updates = to_updates(batch);
  if (!updates.ok()) return updates.status();
  const absl::StatusOr<MemoryBudget::Claim> room = make_room(host, *updates);
  if (!room.ok()) return room.status();
  const absl::StatusOr<UpdateAck> ack = apply_in_time(caller, **scene, *updates);
  if (!ack.ok()) return ack.status();
  *out = to_proto(*ack);
  return absl::OkStatus();
}

}  // namespace

grpc::Status UpdateService::ApplyUpdates(grpc::ServerContext* context, const v1::ApplyUpdatesRequest* request,
                                         v1::ApplyUpdatesResponse* response) {
  return serve(host_, *context, "ApplyUpdates", [&](const Caller& caller) {
    return apply(host_, caller, request->scene(), request->batch(), response->mutable_ack());
  });
}

RawReactor* UpdateService::StreamUpdates(grpc::CallbackServerContext* context) {
  return Stream::open(host_, [this, context](Stream& stream) {
    const Caller caller(host_, *context);
    return answer_all(
        stream, caller, "StreamUpdates",
        [this, &caller](const std::string& scene, const v1::UpdateBatch& batch, v1::StreamUpdatesResponse* response) {
          return apply(host_, caller, scene, batch, response->mutable_ack());
        });
  });
}

}  // namespace locus::server
