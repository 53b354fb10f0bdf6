#include "server/services/update_work.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <utility>
#include <vector>

#include "core/base/limits.h"
#include "core/base/status_macros.h"
#include "server/convert/convert.h"
#include "server/host/memory_use.h"
#include "server/services/creator_quotas.h"

namespace locus::server {
namespace {

// Maximum bytes of one listed item error in an ack, including its text.
constexpr uint64_t kBytesAnItemError = 192;
constexpr uint64_t kBytesAnAck = 256;
// The bound that the protocol states, and the space that a step with the default max_reply_bytes leaves for the ack.
static_assert(kBytesAnAck + kBytesAnItemError * limits::kMaxListedItemErrors == 192'256);
static_assert(limits::kDefaultReplyBytes + 192'256 + 1024 <= 4u << 20, "clients refuse larger messages by default");

// Claims the memory that the batch needs while it is applied. A batch that only removes objects is never refused,
// because it frees memory.
absl::StatusOr<CallMemory> make_room(const Caller& caller, const UpdateBatch& batch) {
  const UpdateCost cost = cost_of(batch);
  switch (cost.kind) {
    case UpdateCost::Kind::kInserts:
      return caller.claim(MemoryLine::kInserts, "inserts", cost.bytes);
    case UpdateCost::Kind::kMoves:
      return caller.claim(MemoryLine::kMoves, "moves", cost.bytes);
    case UpdateCost::Kind::kRemoves:
      return caller.claim_anyway(MemoryLine::kMoves, cost.bytes);
  }
  return caller.claim_anyway(MemoryLine::kMoves, cost.bytes);
}

// Returns an upper bound of the size of the batch's ack, in bytes.
uint64_t ack_bytes(const UpdateBatch& batch) {
  return kBytesAnAck + kBytesAnItemError * std::min<uint64_t>(count_items(batch), limits::kMaxListedItemErrors);
}

absl::Status only_on_streams() {
  return refuse_argument(Reason::kMalformed, "continues", {},
                         "several messages are one revision in StreamUpdates only");
}

}  // namespace

void UpdateWork::begin(const std::string& scene, const v1::UpdateBatch& batch, v1::UpdateAck& ack) {
  arrived_ = std::chrono::steady_clock::now();
  ack_ = &ack;
  absl::Status status = batch.continues() ? only_on_streams() : post(scene, batch);
  if (!status.ok()) refuse(std::move(status));
}

void UpdateWork::begin(const std::string& scene, v1::UpdateBatch& batch, v1::UpdateAck& ack, HeldUpdates& held) {
  arrived_ = std::chrono::steady_clock::now();
  ack_ = &ack;
  const bool continues = batch.continues();
  absl::Status status = held.check_not_refused();
  if (status.ok()) status = continues ? hold(scene, batch, held) : post_all(scene, batch, held);
  if (!status.ok()) {
    held.refuse_rest(continues);
    refuse(std::move(status));
  } else if (continues) {
    ack_->Clear();
    ack_->set_pending(true);
    slot_.answered(absl::OkStatus());
  }
}

void UpdateWork::refuse(absl::Status status) {
  release();
  scene_.reset();
  slot_.answered(std::move(status));
}

absl::Status UpdateWork::hold(const std::string& scene_name, v1::UpdateBatch& batch, HeldUpdates& held) {
  ASSIGN_OR_RETURN(const ScenePtr scene, find_scene(host_, slot_.caller(), scene_name, "scene"));
  RETURN_IF_ERROR(held.check_scene(scene));
  host_.leases.renew(scene, held.writer());
  auto owner = std::make_unique<v1::UpdateBatch>();
  owner->Swap(&batch);
  ASSIGN_OR_RETURN(UpdateBatch message, to_updates(*owner));
  RETURN_IF_ERROR(check_form(message));
  RETURN_IF_ERROR(check_earlier(message));
  RETURN_IF_ERROR(held.check_limits(message));
  RETURN_IF_ERROR(slot_.caller().take_quota(QuotaKind::kUpdateItems, static_cast<double>(item_count(message))));
  RETURN_IF_ERROR(slot_.claim_answer(kBytesAnAck));
  std::vector<CallMemory> claims(2);
  ASSIGN_OR_RETURN(claims[0], make_room(slot_.caller(), message));
  claims[1] = slot_.take_request_claim();
  held.hold(scene, std::move(message), std::move(owner), std::move(claims));
  return absl::OkStatus();
}

absl::Status UpdateWork::post_all(const std::string& scene_name, const v1::UpdateBatch& batch, HeldUpdates& held) {
  ASSIGN_OR_RETURN(scene_, use_scene(host_, slot_.caller(), scene_name, "scene"));
  RETURN_IF_ERROR(held.check_scene(scene_));
  messages_ = held.take();
  held.set_writer(batch.writer());
  return post(scene_name, batch);
}

absl::Status UpdateWork::post(const std::string& scene_name, const v1::UpdateBatch& batch) {
  if (scene_ == nullptr) {
    ASSIGN_OR_RETURN(scene_, use_scene(host_, slot_.caller(), scene_name, "scene"));
  }
  ASSIGN_OR_RETURN(batch_, to_updates(batch));
  lease_ = host_.leases.batch_arrived(scene_, batch_.writer, batch_.lease_ms);
  RETURN_IF_ERROR(slot_.caller().take_quota(QuotaKind::kUpdateItems, static_cast<double>(item_count(batch_))));
  batch_.earlier = std::move(messages_.batches);
  RETURN_IF_ERROR(slot_.claim_answer(ack_bytes(batch_)));
  ASSIGN_OR_RETURN(objects_, hold_objects(host_, *scene_, batch_));
  ASSIGN_OR_RETURN(claim_, make_room(slot_.caller(), batch_));
  const WhenFull when_full = slot_.stream() ? WhenFull::kHold : WhenFull::kRefuse;
  const absl::StatusOr<Posted> posted = host_.updates.post(scene_, *this, when_full);
  if (posted.ok() && *posted == Posted::kFull) slot_.hold();
  return posted.status();
}

// Stores the outcome and posts applied(). The update queue may call done() before UpdateQueue::post() has returned;
// applied() runs after post() has returned, as a later event of the loop.
void UpdateWork::done(absl::StatusOr<UpdateAck> ack) {
  outcome_ = std::move(ack);
  slot_.io().post(applied_);
}

void UpdateWork::release() {
  host_.leases.batch_done(std::exchange(lease_, nullptr), batch_.lease_ms);
  claim_.release();
  objects_.shrink(0);
  batch_.earlier.clear();
  messages_ = {};
}

void UpdateWork::applied(bool) {
  release();
  const UsedScene scene = std::move(scene_);
  if (outcome_.ok()) {
    slot_.caller().audit_update(scene->name(), outcome_->applied);
    host_.metrics.record_update(outcome_->applied, nanoseconds_since(arrived_));
    *ack_ = to_proto(*outcome_);
  }
  slot_.answered(outcome_.status());
}

}  // namespace locus::server
