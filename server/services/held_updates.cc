#include "server/services/held_updates.h"

#include <utility>

#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/base/refusal.h"

namespace locus::server {

absl::Status HeldUpdates::check_not_refused() const {
  if (!refused_) return absl::OkStatus();
  Refusal refusal;
  refusal.reason = Reason::kMalformed;
  refusal.field = "continues";
  return refuse(absl::StatusCode::kFailedPrecondition,
                "an earlier message of this revision was refused, so nothing of it is applied; send all messages again",
                refusal);
}

absl::Status HeldUpdates::check_scene(const ScenePtr& scene) const {
  if (messages_.batches.empty() || messages_.scene.lock() == scene) return absl::OkStatus();
  Refusal refusal;
  refusal.reason = Reason::kNotFound;
  refusal.field = "scene";
  return refuse(absl::StatusCode::kNotFound, "the scene of the earlier messages was deleted", refusal);
}

absl::Status HeldUpdates::check_limits(const UpdateBatch& batch) const {
  const uint64_t messages = messages_.batches.size() + 2;  // with this message and the last
  if (messages > limits::kMaxUpdateMessages)
    return refuse_limit("continues", "update_messages", limits::kMaxUpdateMessages, static_cast<double>(messages));
  if (const uint64_t items = items_ + count_items(batch); items > limits::kMaxUpdateItems)
    return refuse_limit("batch", "update_items", limits::kMaxUpdateItems, static_cast<double>(items));
  if (const uint64_t lists = lists_ + count_lists(batch); lists > limits::kMaxUpdateLists)
    return refuse_limit("batch", "update_lists", limits::kMaxUpdateLists, static_cast<double>(lists));
  return absl::OkStatus();
}

void HeldUpdates::hold(const ScenePtr& scene, UpdateBatch batch, std::unique_ptr<const v1::UpdateBatch> owner,
                       std::vector<CallMemory> claims) {
  LOCUS_DCHECK(!refused_ && check_limits(batch).ok() && check_scene(scene).ok());
  if (messages_.batches.empty()) messages_.scene = scene;
  items_ += count_items(batch);
  lists_ += count_lists(batch);
  messages_.batches.push_back(std::move(batch));
  messages_.owners.push_back(std::move(owner));
  for (CallMemory& claim : claims) messages_.claims.push_back(std::move(claim));
}

HeldUpdates::Messages HeldUpdates::take() {
  items_ = lists_ = 0;
  return std::exchange(messages_, {});
}

void HeldUpdates::refuse_rest(bool continues) {
  take();
  refused_ = continues;
}

}  // namespace locus::server
