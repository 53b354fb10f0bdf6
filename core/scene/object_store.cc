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

size_t ObjectStore::apply(absl::Span<const Object> removed, absl::Span<const Object> inserted) {
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
    for (size_t i = 0; i < removed.size(); ++i) kept.emplace(removed[i].id, leaving[i]);
  std::vector<GridItem> items;
  items.reserve(inserted.size());
  for (const Object& object : inserted) {
    const auto before = kept.find(object.id);
    const bool changed = before != kept.end();
    const uint32_t handle = changed ? before->second : new_handle();
    if (changed) {
      kept.erase(before);
    } else {
      handles_for_readers_.set(object.id, handle);
    }
    LOCUS_CHECK(handles_.emplace(object.id, handle).second);
    items.push_back(grid_item_of(object, handle));
  }
  for (size_t i = 0; i < removed.size(); ++i) {
    if (handles_.contains(removed[i].id)) continue;
    handles_for_readers_.erase(removed[i].id);
    free_handles_.push_back(leaving[i]);
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
