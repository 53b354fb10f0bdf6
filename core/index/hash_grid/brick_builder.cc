#include "core/index/hash_grid/brick_builder.h"

#include <algorithm>

#include "core/base/check.h"

namespace locus::internal {
namespace {

// A brick of fewer values is sorted anew whatever changes: that costs no more.
constexpr uint32_t kFewestSorted = 128;
// Beyond these a brick is sorted anew, since every query goes through what changed lately.
constexpr uint32_t kMostRecent = 64;
constexpr uint32_t kSortedPerChange = 8;  // sorted values for each change of one batch
constexpr uint32_t kSortedPerGone = 4;    // sorted values for each that is gone

// In the lists of changes by slot. Numbers of moves are smaller.
constexpr uint32_t kStays = ~0u - 1;

}  // namespace

BrickPtr BrickBuilder::apply(const Brick* old, const BrickPlace& place, uint32_t number,
                             absl::Span<const BrickChange> changes, const BatchParts& parts,
                             std::vector<GridSlot>& slots) {
  place_ = &place;
  number_ = number;
  parts_ = parts;
  slots_ = &slots;
  sources_.clear();
  return is_few(old, changes.size()) ? change_few(*old, changes) : sort_anew(old, changes);
}

bool BrickBuilder::is_few(const Brick* old, size_t changes) {
  if (old == nullptr || old->sorted->count() < kFewestSorted) return false;
  const uint32_t recent = old->recent == nullptr ? 0 : old->recent->count();
  return changes * kSortedPerChange <= old->sorted->count() && recent + changes <= kMostRecent &&
         (old->gone_count + changes) * kSortedPerGone <= old->sorted->count();
}

void BrickBuilder::mark_changes(const Brick& old, absl::Span<const BrickChange> changes) {
  sorted_changes_.assign(old.sorted->count(), kStays);
  recent_changes_.assign(old.recent == nullptr ? 0 : old.recent->count(), kStays);
  for (const BrickChange& change : changes) {
    if (change.slot == BrickChange::kArrives) continue;
    if (change.number != BrickChange::kLeaves) __builtin_prefetch(&parts_.moves[change.number]);
    const uint32_t slot = change.slot & ~GridSlot::kRecent;
    std::vector<uint32_t>& marks = (change.slot & GridSlot::kRecent) != 0 ? recent_changes_ : sorted_changes_;
    LOCUS_DCHECK(slot < marks.size());
    marks[slot] = change.number;
  }
}

inline void BrickBuilder::add_source(const GridBlock& block, uint32_t slot, uint32_t change) {
  if (change == kStays) {
    const Vec3d position = block.entry(slot).position;
    sources_.push_back({position, &block, slot, kNoMove, cell_of(position)});
  } else {
    const Vec3d position = parts_.moves[change].position;
    sources_.push_back({position, &block, slot, change, cell_of(position)});
  }
}

// Those of `brick`, if given, that were gone before are left out, and so are those that leave.
void BrickBuilder::add_sources(const GridBlock& block, const std::vector<uint32_t>& changes, const Brick* brick) {
  for (uint32_t slot = 0; slot < block.count(); ++slot) {
    const uint32_t change = changes[slot];
    if (change != BrickChange::kLeaves && (brick == nullptr || !brick->is_gone(slot))) add_source(block, slot, change);
  }
}

void BrickBuilder::add_arrivals(absl::Span<const BrickChange> changes) {
  for (const BrickChange& change : changes) {
    if (change.slot != BrickChange::kArrives) continue;
    const Vec3d position = parts_.arrivals[change.number].entry.position;
    sources_.push_back({position, nullptr, change.number, kNoMove, cell_of(position)});
  }
}

GridForm BrickBuilder::form_of(const Source& source) const {
  GridForm form = source.block == nullptr ? parts_.arrivals[source.slot].form : source.block->form(source.slot);
  if (source.move != kNoMove && parts_.moves[source.move].turns) form.rotation = parts_.moves[source.move].rotation;
  return form;
}

bool BrickBuilder::any_form(const Brick* old, absl::Span<const BrickChange> changes) const {
  if (parts_.turns) return true;
  if (old != nullptr && (old->sorted->has_forms() || (old->recent != nullptr && old->recent->has_forms()))) return true;
  return std::any_of(changes.begin(), changes.end(), [this](const BrickChange& change) {
    return change.slot == BrickChange::kArrives && !(parts_.arrivals[change.number].form == GridForm());
  });
}

template <class PlaceOf>
inline void BrickBuilder::write(GridBlock& block, uint32_t flag, const GridBlock* before, const PlaceOf& place_of) {
  std::vector<GridSlot>& slots = *slots_;
  for (size_t i = 0; i < sources_.size(); ++i) {
    const Source& source = sources_[i];
    const uint32_t slot = place_of(i);
    uint32_t handle = 0;
    if (source.block != nullptr) {
      handle = source.block->handle(source.slot);
      block.put(slot, source.block->entry(source.slot), source.position, handle, source.block->reach(source.slot),
                place_->center);
    } else {
      const GridItem& arrival = parts_.arrivals[source.slot];
      handle = arrival.handle;
      block.put(slot, arrival.entry, source.position, handle, arrival.reach, place_->center);
    }
    if (block.has_forms()) block.put_form(slot, form_of(source));
    if (source.block == nullptr || source.block != before || source.slot != slot)
      slots[handle] = {number_, slot | flag};
  }
}

BrickPtr BrickBuilder::sort_anew(const Brick* old, absl::Span<const BrickChange> changes) {
  if (old != nullptr) {
    mark_changes(*old, changes);
    add_sources(*old->sorted, sorted_changes_, old);
    if (old->recent != nullptr) add_sources(*old->recent, recent_changes_, nullptr);
  }
  add_arrivals(changes);
  if (sources_.empty()) return nullptr;
  const auto block = std::make_shared<GridBlock>(static_cast<uint32_t>(sources_.size()), any_form(old, changes));
  std::array<uint32_t, kBrickCells + 1>& offsets = block->offsets();
  for (const Source& source : sources_) ++offsets[source.cell + 1];
  for (size_t cell = 0; cell < kBrickCells; ++cell) offsets[cell + 1] += offsets[cell];
  std::array<uint32_t, kBrickCells + 1> next = offsets;
  write(*block, 0, nullptr, [&](size_t i) { return next[sources_[i].cell]++; });
  auto brick = std::make_shared<Brick>();
  brick->place = *place_;
  brick->number = number_;
  brick->sorted = block;
  return brick;
}

BrickPtr BrickBuilder::change_few(const Brick& old, absl::Span<const BrickChange> changes) {
  auto brick = std::make_shared<Brick>(old);
  if (brick->gone.empty()) brick->gone.resize(old.sorted->count() / 64 + 2);
  recent_changes_.assign(old.recent == nullptr ? 0 : old.recent->count(), kStays);
  for (const BrickChange& change : changes)
    if (change.slot != BrickChange::kArrives && (change.slot & GridSlot::kRecent) != 0)
      recent_changes_[change.slot & ~GridSlot::kRecent] = change.number;
  // First those that were recent before, so that they keep their slots: to note where each is costs more than to copy
  // it.
  if (old.recent != nullptr) add_sources(*old.recent, recent_changes_, nullptr);
  for (const BrickChange& change : changes) {
    if (change.slot == BrickChange::kArrives || (change.slot & GridSlot::kRecent) != 0) continue;
    brick->gone[change.slot / 64] |= uint64_t{1} << (change.slot % 64);
    ++brick->gone_count;
    if (change.number != BrickChange::kLeaves) add_source(*old.sorted, change.slot, change.number);
  }
  add_arrivals(changes);
  brick->recent = nullptr;
  if (!sources_.empty()) {
    const auto block = std::make_shared<GridBlock>(static_cast<uint32_t>(sources_.size()), any_form(&old, changes));
    write(*block, GridSlot::kRecent, old.recent.get(), [](size_t i) { return static_cast<uint32_t>(i); });
    brick->recent = block;
  }
  return brick->size() == 0 ? nullptr : brick;
}

}  // namespace locus::internal
