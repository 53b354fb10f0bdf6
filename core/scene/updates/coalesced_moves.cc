#include "core/scene/updates/coalesced_moves.h"

#include "core/base/check.h"

namespace locus {

void CoalescedMoves::check_invariants(uint32_t handle) {
  const GridMove* const move = find(handle);
  LOCUS_CHECK(move != nullptr);
  LOCUS_CHECK(move->rotation == GridMove::kKeeps || move->rotation < rotations_.size());
  LOCUS_CHECK_LE(moves_.size(), move_of_handle_.size());
}

bool CoalescedMoves::differs(const GridMove& move, const Quaternion* rotation, const GridMove* before,
                             const GridRef& stored) const {
  const Vec3d& position = before != nullptr ? before->position : stored.entry().position;
  if (!(move.position == position)) return true;
  if (rotation == nullptr) return false;
  const bool rotated = before != nullptr && before->rotation != GridMove::kKeeps;
  return !(*rotation == (rotated ? rotations_[before->rotation] : stored.form().rotation));
}

bool CoalescedMoves::add(const GridMoves& batch, const ObjectStore& store) {
  if (move_of_handle_.size() < store.handle_count()) move_of_handle_.resize(store.handle_count());
  bool changes = false;
  for (const GridMove& move : batch.moves) {
    LOCUS_DCHECK_LT(size_t{move.handle}, store.handle_count());
    LOCUS_DCHECK(move.rotation == GridMove::kKeeps || move.rotation < batch.rotations.size());
    GridMove* known = find(move.handle);
    const Quaternion* rotation = move.rotation == GridMove::kKeeps ? nullptr : &batch.rotations[move.rotation];
    changes = changes || differs(move, rotation, known, store.at(move.handle));
    if (known == nullptr) {
      move_of_handle_[move.handle] = static_cast<uint32_t>(moves_.size());
      known = &moves_.emplace_back();
      known->handle = move.handle;
    }
    known->position = move.position;
    if (rotation == nullptr) continue;
    if (known->rotation == GridMove::kKeeps) {
      known->rotation = static_cast<uint32_t>(rotations_.size());
      rotations_.emplace_back();
    }
    rotations_[known->rotation] = *rotation;
  }
  if constexpr (kDebugChecks)
    for (const GridMove& move : batch.moves) check_invariants(move.handle);
  return changes;
}

}  // namespace locus
