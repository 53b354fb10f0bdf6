#include "core/scene/object_store.h"

#include "core/base/check.h"

namespace locus {

std::optional<Object> ObjectStore::find(Id id) const {
  const uint32_t known = handle(id);
  return known == kNoHandle ? std::nullopt : std::optional<Object>(object_of(grid_.at(known)));
}

uint32_t ObjectStore::new_handle() {
  if (free_handles_.empty()) return next_handle_++;
  const uint32_t handle = free_handles_.back();
  free_handles_.pop_back();
  return handle;
}

void ObjectStore::free_handle(uint32_t handle) {
  if (moves_ == nullptr) {
    free_handles_.push_back(handle);
  } else {
    resting_.push_back({handle, tick_});
  }
}

// Sets from the end of a tick hold no life that ended in it.
void ObjectStore::start_tick(uint64_t tick, uint64_t oldest_tick) {
  LOCUS_CHECK(moves_ != nullptr);
  tick_ = tick;
  moves_->start_tick(grid_.cell_size());
  for (; !resting_.empty() && resting_.front().tick <= oldest_tick; resting_.pop_front())
    free_handles_.push_back(resting_.front().handle);
}

size_t ObjectStore::move(absl::Span<const GridMove> moves, absl::Span<const uint32_t> moves_by_handle) {
  if (moves_ != nullptr)
    for (const GridMove& move : moves) moves_->moved(grid_.at(move.handle), move.position);
  return grid_.apply({{}, moves, {}, moves_by_handle});
}

size_t ObjectStore::apply(absl::Span<const Object> removed, absl::Span<const Object> inserted,
                          const absl::flat_hash_set<Id>& reborn) {
  std::vector<uint32_t> leaving;
  leaving.reserve(removed.size());
  for (const Object& object : removed) {
    const uint32_t known = handle(object.id);
    LOCUS_CHECK_NE(known, kNoHandle);
    leaving.push_back(known);
    handles_.erase(object.id);
  }
  // Those that only change keep their handle.
  absl::flat_hash_map<Id, uint32_t> kept;
  if (!inserted.empty())
    for (size_t i = 0; i < removed.size(); ++i)
      if (!reborn.contains(removed[i].id)) kept.emplace(removed[i].id, leaving[i]);
  std::vector<GridItem> items;
  items.reserve(inserted.size());
  for (const Object& object : inserted) {
    const auto before = kept.find(object.id);
    const bool changed = before != kept.end();
    const uint32_t handle = changed ? before->second : new_handle();
    if (changed) {
      kept.erase(before);
      if (moves_ != nullptr) moves_->moved(grid_.at(handle), object.shape.position);
    } else {
      handles_for_readers_.set(object.id, handle);
      if (moves_ != nullptr) moves_->born(handle);
    }
    LOCUS_CHECK(handles_.emplace(object.id, handle).second);
    items.push_back(grid_item_of(object, handle));
  }
  for (size_t i = 0; i < removed.size(); ++i) {
    const uint32_t now = handle(removed[i].id);
    if (now == leaving[i]) continue;
    if (now == kNoHandle) handles_for_readers_.erase(removed[i].id);
    free_handle(leaving[i]);
  }
  return grid_.apply({leaving, {}, items});
}

bool ObjectStore::remove(const Object& object) {
  const std::optional<Object> known = find(object.id);
  if (!known) return false;
  apply({&*known, 1}, {});
  return true;
}

}  // namespace locus
