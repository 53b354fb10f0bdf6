#include "core/scene/objects/object_store.h"

#include <algorithm>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "core/base/planted_bug.h"

namespace locus {
namespace {

constexpr size_t kPrefetchObjects = 16;  // prefetch distance, in objects
constexpr uint32_t kNewLife = ~0u;       // marks an inserted object that begins a new lifetime

// Returns, for each object of `inserted`, the index in `removed` of the old state of the same object. Returns kNewLife
// if `removed` has no object with this id, or if the id is in `replaced`.
std::vector<uint32_t> updated_objects(absl::Span<const Object> removed, absl::Span<const Object> inserted,
                                      const absl::flat_hash_set<Id>& replaced) {
  std::vector<uint32_t> before(inserted.size(), kNewLife);
  if (removed.empty() || inserted.empty()) return before;
  absl::flat_hash_map<Id, uint32_t> indices;
  for (uint32_t i = 0; i < removed.size(); ++i)
    if (!replaced.contains(removed[i].id)) indices.emplace(removed[i].id, i);
  for (size_t i = 0; i < inserted.size(); ++i)
    if (const auto found = indices.find(inserted[i].id); found != indices.end()) before[i] = found->second;
  return before;
}

}  // namespace

void ObjectStore::check_invariants() const {
  if (!planted(PlantedBug::kGhostAfterMove)) LOCUS_CHECK_EQ(grid_.size(), handles_.size());
  LOCUS_CHECK_EQ(size_t{next_handle_}, handles_.size() + free_handles_.size() + quarantined_handles_.size());
  LOCUS_CHECK(moves_ != nullptr || quarantined_handles_.empty());
  LOCUS_CHECK(free_handles_.empty() || free_handles_.back() < next_handle_);
}

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
  LOCUS_DCHECK_LT(handle, next_handle_);
  ++ended_lives_;
  if (moves_ == nullptr) {
    free_handles_.push_back(handle);
  } else {
    LOCUS_DCHECK(quarantined_handles_.empty() || quarantined_handles_.back().tick <= tick_);
    quarantined_handles_.push_back({handle, tick_});
  }
}

// Frees even the handles of objects that were removed in `oldest_tick` itself. The history's object set for
// `oldest_tick` was made at the end of that tick, and so does not contain these objects.
void ObjectStore::start_tick(uint64_t tick, uint64_t oldest_tick) {
  LOCUS_CHECK(moves_ != nullptr);
  tick_ = tick;
  moves_->start_tick(grid_.cell_size());
  for (; !quarantined_handles_.empty() && quarantined_handles_.front().tick <= oldest_tick;
       quarantined_handles_.pop_front())
    free_handles_.push_back(quarantined_handles_.front().handle);
  LOCUS_DCHECK(quarantined_handles_.empty() || quarantined_handles_.back().tick <= tick);
  LOCUS_DCHECK_CALL(check_invariants());
}

size_t ObjectStore::move(const GridMoves& moves) {
  for (const GridMove& move : moves.moves) {
    LOCUS_DCHECK_LT(move.handle, next_handle_);
    LOCUS_DCHECK(move.rotation == GridMove::kKeeps || move.rotation < moves.rotations.size());
  }
  if (moves_ != nullptr)
    for (const GridMove& move : moves.moves) moves_->moved(grid_.at(move.handle), move.position);
  const size_t replaced_bytes = grid_.apply({{}, moves, {}});
  LOCUS_DCHECK_CALL(check_invariants());
  return replaced_bytes;
}

// Returns the handle of each object. Precondition: all objects are present.
std::vector<uint32_t> ObjectStore::handles_of(absl::Span<const Object> objects) const {
  std::vector<Id> ids;
  ids.reserve(objects.size());
  for (const Object& object : objects) ids.push_back(object.id);
  std::vector<uint32_t> handles(ids.size());
  find_handles(ids, absl::MakeSpan(handles));
  for (const uint32_t known : handles) LOCUS_CHECK_NE(known, kNoHandle);
  return handles;
}

void ObjectStore::change_group(uint32_t handle, Group from, Group to) {
  if (from == to) return;
  groups_.remove(from, handle);
  groups_.add(to, handle);
  groups_changed_ = true;
}

GridItem ObjectStore::begin_life(const Object& object) {
  const uint32_t handle = new_handle();
  LOCUS_CHECK(handles_.set(object.id, handle));
  change_group(handle, 0, object.group);
  if (moves_ != nullptr) moves_->born(handle);
  return grid_item_of(object, handle);
}

GridItem ObjectStore::continue_life(const Object& object, uint32_t handle) {
  if (moves_ != nullptr) moves_->moved(grid_.at(handle), object.shape.position);
  return grid_item_of(object, handle);
}

size_t ObjectStore::apply(absl::Span<const Object> removed, absl::Span<const Object> inserted,
                          const absl::flat_hash_set<Id>& replaced) {
  const std::vector<uint32_t> leaving = handles_of(removed);
  const std::vector<uint32_t> before = updated_objects(removed, inserted, replaced);
  std::vector<uint8_t> ends(removed.size(), 1);
  for (const uint32_t index : before)
    if (index != kNewLife) LOCUS_CHECK_EQ(std::exchange(ends[index], uint8_t{0}), 1);
  for (size_t i = 0; i < removed.size(); ++i) {
    if (ends[i] == 0) continue;
    LOCUS_CHECK(handles_.erase(removed[i].id));
    change_group(leaving[i], removed[i].group, 0);
  }
  for (size_t i = 0; i < inserted.size(); ++i)
    if (before[i] != kNewLife) change_group(leaving[before[i]], removed[before[i]].group, inserted[i].group);
  handles_.fit(handles_.size() + static_cast<size_t>(std::count(before.begin(), before.end(), kNewLife)));
  std::vector<GridItem> items;
  items.reserve(inserted.size());
  for (size_t i = 0; i < inserted.size(); ++i) {
    if (i + kPrefetchObjects < inserted.size()) handles_.prefetch(inserted[i + kPrefetchObjects].id);
    items.push_back(before[i] == kNewLife ? begin_life(inserted[i]) : continue_life(inserted[i], leaving[before[i]]));
  }
  for (size_t i = 0; i < removed.size(); ++i)
    if (ends[i] != 0) free_handle(leaving[i]);
  const size_t replaced_bytes = grid_.apply({leaving, {}, items}) + handles_.take_replaced_bytes();
  for (const Object& object : inserted) compounds_.add(object.compound);
  for (const Object& object : removed) compounds_.remove(object.compound);
  LOCUS_DCHECK_CALL(check_invariants());
  return replaced_bytes + compounds_.take_replaced_bytes();
}

bool ObjectStore::fill(std::vector<std::vector<Object>> chunks, double cell_size) {
  LOCUS_CHECK_EQ(next_handle_, 0u);
  size_t count = 0;
  for (const std::vector<Object>& chunk : chunks) count += chunk.size();
  handles_.fit(count);
  std::vector<GridItem> items;
  items.reserve(count);
  for (std::vector<Object>& chunk : chunks) {
    for (size_t i = 0; i < chunk.size(); ++i) {
      if (i + kPrefetchObjects < chunk.size()) handles_.prefetch(chunk[i + kPrefetchObjects].id);
      const uint32_t handle = new_handle();
      if (!handles_.set(chunk[i].id, handle)) return false;
      change_group(handle, 0, chunk[i].group);
      if (moves_ != nullptr) moves_->born(handle);
      compounds_.add(chunk[i].compound);
      items.push_back(grid_item_of(chunk[i], handle));
    }
    std::vector<Object>().swap(chunk);
  }
  grid_.fill(items, cell_size);
  handles_.take_replaced_bytes();
  LOCUS_DCHECK_CALL(check_invariants());
  return true;
}

bool ObjectStore::remove(const Object& object) {
  const std::optional<Object> known = find(object.id);
  if (!known) return false;
  apply({&*known, 1}, {});
  return true;
}

}  // namespace locus
