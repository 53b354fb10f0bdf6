#include "server/services/update_work.h"

#include <chrono>
#include <utility>

#include "core/base/status_macros.h"
#include "server/convert/convert.h"
#include "server/host/memory_use.h"

namespace locus::server {
namespace {

// Claims the memory that the batch needs while it is applied. Only a batch with inserts can be refused; moves change
// existing objects, and removes free memory.
absl::StatusOr<MemoryBudget::Claim> make_room(Host& host, const UpdateBatch& batch) {
  const UpdateCost cost = cost_of(batch);
  if (cost.inserts) return host.memory.claim("inserts", cost.bytes);
  return host.memory.claim_anyway(cost.bytes);
}

}  // namespace

void UpdateWork::begin(const std::string& scene, const v1::UpdateBatch& batch, v1::UpdateAck& ack) {
  arrived_ = std::chrono::steady_clock::now();
  ack_ = &ack;
  if (absl::Status status = post(scene, batch); !status.ok()) {
    claim_.reset();
    slot_.answered(std::move(status));
  }
}

absl::Status UpdateWork::post(const std::string& scene_name, const v1::UpdateBatch& batch) {
  ASSIGN_OR_RETURN(const ScenePtr scene, find_scene(slot_.caller(), scene_name, "scene"));
  ASSIGN_OR_RETURN(UpdateBatch updates, to_updates(batch));
  batch_ = std::move(updates);
  ASSIGN_OR_RETURN(MemoryBudget::Claim claim, make_room(slot_.host(), batch_));
  claim_.emplace(std::move(claim));
  const WhenFull when_full = slot_.stream() ? WhenFull::kHold : WhenFull::kRefuse;
  const absl::StatusOr<Posted> posted = slot_.host().updates.post(scene, *this, when_full);
  if (posted.ok() && *posted == Posted::kFull) slot_.hold();
  return posted.status();
}

// Posts applied() with the outcome. The update queue may call this before its post() has returned; applied() runs after
// that, as a later event of the loop.
void UpdateWork::done(absl::StatusOr<UpdateAck> ack) {
  outcome_ = std::move(ack);
  slot_.io().post(applied_);
}

void UpdateWork::applied(bool) {
  claim_.reset();
  if (outcome_.ok()) {
    slot_.host().metrics.record_update(outcome_->applied, nanoseconds_since(arrived_));
    *ack_ = to_proto(*outcome_);
  }
  slot_.answered(outcome_.status());
}

}  // namespace locus::server
