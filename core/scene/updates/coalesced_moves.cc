#include "core/scene/updates/coalesced_moves.h"

namespace locus {

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
  return changes;
}

}  // namespace locus
