// Work on one update batch, from its message to its ack: converts the batch, claims memory from the budget, and posts
// the batch to the update queue. A message with `continues` is held instead, until the last message of its revision
// posts all of them as one batch.
//
// Threads: members run on the call's IO loop, except batch(), stop() and done(), which the update queue calls on any
// thread.
#ifndef LOCUS_SERVER_SERVICES_UPDATE_WORK_H_
#define LOCUS_SERVER_SERVICES_UPDATE_WORK_H_

#include <string>

#include "core/scene/updates/update_batch.h"
#include "locus/v1/update_service.pb.h"
#include "server/host/host.h"
#include "server/rpc/call_slot.h"
#include "server/rpc/io_threads.h"
#include "server/scheduling/update_queue.h"
#include "server/services/held_updates.h"
#include "server/services/scene_access.h"

namespace locus::server {

class UpdateWork final : private PendingUpdate {
 public:
  UpdateWork(Host& host, CallSlot& slot) : host_(host), slot_(slot) {}

  // Begins the work. `batch` and `ack` are borrowed until the slot is answered.
  void begin(const std::string& scene, const v1::UpdateBatch& batch, v1::UpdateAck& ack);
  // Begins the work on a message of a stream, which holds `held`. Empties `batch` if the message is held.
  void begin(const std::string& scene, v1::UpdateBatch& batch, v1::UpdateAck& ack, HeldUpdates& held);
  // Does nothing: the update queue calls stop() before it applies a batch, and answers at once if stop() returns an
  // error.
  void give_up() {}

 private:
  // Posts a batch, which is applied after the messages in messages_.
  absl::Status post(const std::string& scene, const v1::UpdateBatch& batch);
  absl::Status hold(const std::string& scene, v1::UpdateBatch& batch, HeldUpdates& held);
  // Takes over the held messages, and posts them with the last message of their revision.
  absl::Status post_all(const std::string& scene, const v1::UpdateBatch& batch, HeldUpdates& held);

  const UpdateBatch& batch() const override { return batch_; }
  absl::Status stop() const override { return slot_.caller().stop(); }
  void done(absl::StatusOr<UpdateAck> ack) override;
  void applied(bool);
  // Releases everything that the work holds, and answers with an error.
  void refuse(absl::Status status);
  void release();

  Host& host_;
  CallSlot& slot_;
  UpdateBatch batch_;
  HeldUpdates::Messages messages_;  // earlier messages of the batch, from which it borrows columns
  UsedScene scene_;                 // null until the scene is found
  LeaseKeeper::Batch lease_;        // renews the lease of the batch's writer; null if there is none
  SteadyTime arrived_;
  v1::UpdateAck* ack_ = nullptr;
  CallMemory claim_;
  // Quota of the objects that the batch adds; held until the batch is applied.
  QuotaHold objects_;
  absl::StatusOr<UpdateAck> outcome_;
  MemberTag<UpdateWork> applied_{*this, &UpdateWork::applied};
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_UPDATE_WORK_H_
