#include "client/cli/pending_batch.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "client/cli/failure.h"
#include "core/base/status_macros.h"

namespace locus::cli {

absl::Status PendingBatch::add(const std::string& scene, const v1::UpdateBatch& line) {
  if (!scene_.empty() && scene != scene_) {
    return usage_error(
        absl::StrCat("a batch is for one scene: this one is for ", scene_, ", commit it before changing ", scene));
  }
  if (line.has_tick()) return usage_error("a batch has one tick: write `begin --tick N`");
  if (line.has_frame()) return usage_error("this line sends its own batch: put it before begin or behind commit");
  if (line.inserts_size() > 0 && batch_.inserts_size() > 0 && line.upsert() != batch_.upsert()) {
    return usage_error("all inserts of a batch have --upsert, or none has");
  }
  RETURN_IF_ERROR(check_order(line));
  remember(line);
  scene_ = scene;
  batch_.MergeFrom(line);
  return absl::OkStatus();
}

absl::Status PendingBatch::check_order(const v1::UpdateBatch& line) const {
  if (line.clear() && !last_step_.empty()) {
    return usage_error("a batch removes everything before all else: put this line first, or commit before it");
  }
  const bool later = std::any_of(last_step_.begin(), last_step_.end(),
                                 [](const auto& entry) { return entry.second != Step::kRemove; });
  if (line.remove_groups_size() > 0 && later) {
    return usage_error("a batch removes before it inserts and moves: put this line first, or commit before it");
  }
  return check_ids(line);
}

absl::Status PendingBatch::check_ids(const v1::UpdateBatch& line) const {
  absl::Status status;
  const auto check = [&](const auto& ids, Step step) {
    for (const uint64_t id : ids) status.Update(check_step(id, step));
  };
  check(line.remove_ids(), Step::kRemove);
  for (const v1::Insert& insert : line.inserts()) check(insert.ids(), Step::kInsert);
  for (const v1::Move& move : line.moves()) check(move.ids(), Step::kMove);
  for (const v1::Relabel& relabel : line.relabels()) check(relabel.ids(), Step::kRelabel);
  return status;
}

absl::Status PendingBatch::check_step(uint64_t id, Step step) const {
  const auto found = last_step_.find(id);
  if (found == last_step_.end() || found->second <= step) return absl::OkStatus();
  return usage_error(absl::StrCat("a batch removes, then inserts, then moves, but an earlier line of it already ",
                                  found->second == Step::kInsert ? "inserts" : "changes", " ", id,
                                  ": put this line before that one, or commit between them"));
}

void PendingBatch::remember(const v1::UpdateBatch& line) {
  for (const uint64_t id : line.remove_ids()) last_step_[id] = Step::kRemove;
  for (const v1::Insert& insert : line.inserts()) {
    for (const uint64_t id : insert.ids()) last_step_[id] = Step::kInsert;
  }
  for (const v1::Move& move : line.moves()) {
    for (const uint64_t id : move.ids()) last_step_[id] = Step::kMove;
  }
  for (const v1::Relabel& relabel : line.relabels()) {
    for (const uint64_t id : relabel.ids()) last_step_[id] = Step::kRelabel;
  }
}

}  // namespace locus::cli
