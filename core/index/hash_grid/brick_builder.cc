#include "core/index/hash_grid/brick_builder.h"

#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "core/base/planted_bug.h"

namespace locus::internal {
namespace {

// Minimum number of sorted values of a brick for which changes are appended to its log. A smaller brick is sorted again
// instead, which costs no more than appending.
constexpr uint32_t kMinSorted = 48;
constexpr uint32_t kSortedPerChange = 8;  // min ratio of sorted values to changes for appending to the log
constexpr uint32_t kSortedPerDead = 4;    // min ratio of sorted values to dead values for appending to the log
constexpr size_t kPrefetchValues = 16;    // distance, in values, from a prefetch to the use of its data

// Mark of an unchanged value in sorted_changes_ and recent_changes_, larger than every index of a move.
constexpr uint32_t kStays = ~0u - 1;

bool arrives(const BrickChange& change) { return change.slot == BrickChange::kArrives; }

}  // namespace

void BrickBuilder::begin(const BatchParts& parts, std::vector<GridSlot>& slots) {
  LOCUS_DCHECK_LT(parts.moves.moves.size(), size_t{kStays});
  LOCUS_DCHECK_LT(parts.arrivals.size(), size_t{BrickSource::kArrival});
  parts_ = parts;
  slots_ = &slots;
  sources_.clear();
}

BrickPtr BrickBuilder::apply(const Brick* old, const BrickGeometry& geometry, uint32_t index,
                             absl::Span<const BrickChange> changes) {
  LOCUS_DCHECK(slots_ != nullptr);
  LOCUS_DCHECK_CALL(check_changes(old, changes));
  geometry_ = &geometry;
  index_ = index;
  max_extent_ = old == nullptr ? 0 : old->max_extent;
  if (is_few(old, changes) &&
      (old->sorted->has_forms() || (parts_.moves.rotations.empty() && !any_form_arrives(changes))))
    return change_few(*old, changes);
  sources_.clear();
  return sort_anew(old, changes);
}

BrickPtr BrickBuilder::build(const Brick* old, const BrickGeometry& geometry, uint32_t index,
                             absl::Span<const BrickSource> sources, absl::Span<const BrickChange> changes) {
  geometry_ = &geometry;
  index_ = index;
  max_extent_ = old == nullptr ? 0 : old->max_extent;
  LOCUS_DCHECK(slots_ != nullptr);
  LOCUS_DCHECK(std::all_of(changes.begin(), changes.end(), arrives));
  LOCUS_DCHECK_CALL(check_changes(old, changes));
  if (changes.empty()) return sorted_by_cell(old, sources);
  sources_.assign(sources.begin(), sources.end());
  add_arrivals(changes);
  return sorted_by_cell(old, sources_);
}

// Checks the changes. The change of a value that arrives must refer to an existing arrival. Every other change must
// refer to a live slot of `old` and, unless the value leaves, to an existing move. O(changes).
void BrickBuilder::check_changes(const Brick* old, absl::Span<const BrickChange> changes) const {
  for (const BrickChange& change : changes) {
    if (arrives(change)) {
      LOCUS_DCHECK_LT(change.index, parts_.arrivals.size());
      continue;
    }
    LOCUS_DCHECK(old != nullptr);
    if (change.index != BrickChange::kLeaves) LOCUS_DCHECK_LT(change.index, parts_.moves.moves.size());
    const uint32_t slot = change.slot & ~GridSlot::kRecent;
    const bool recent = (change.slot & GridSlot::kRecent) != 0;
    LOCUS_DCHECK_LT(slot, recent ? old->recent_count : old->sorted->count());
    const bool dead = recent ? old->is_recent_dead(slot) : old->is_dead(slot);
    LOCUS_DCHECK(!dead || planted(PlantedBug::kGhostAfterMove));
  }
}

// Checks a value that was just written: slots_ holds its location, and brick.max_extent is at least its extent.
void BrickBuilder::check_value(const Brick& brick, const GridBlock& block, uint32_t slot, uint32_t flag) const {
  LOCUS_DCHECK_LT(block.handle(slot), slots_->size());
  LOCUS_DCHECK_LE(block.extent(slot), brick.max_extent);
  if (planted(PlantedBug::kGhostAfterMove)) return;  // with this bug a handle has several slots
  const GridSlot& location = (*slots_)[block.handle(slot)];
  LOCUS_DCHECK_EQ(location.brick, index_);
  LOCUS_DCHECK_EQ(location.slot, slot | flag);
}

// Checks a version whose values have all been sorted. O(values).
void BrickBuilder::check_sorted(const Brick& brick) const {
  LOCUS_DCHECK_CALL(brick.check_invariants());
  const GridBlock& sorted = *brick.sorted;
  LOCUS_DCHECK_CALL(sorted.check_invariants());
  for (int cell = 0; cell < kBrickCells; ++cell) {
    const auto begin = static_cast<size_t>(cell);
    for (uint32_t slot = sorted.offsets()[begin]; slot < sorted.offsets()[begin + 1]; ++slot) {
      check_value(brick, sorted, slot, 0);
      LOCUS_DCHECK(planted(PlantedBug::kUnsignedCellIndex) ||
                   brick.geometry.cell_nearly_holds(cell, sorted.entry(slot).position));
    }
  }
}

// Checks a version whose log has new values from slot `begin` on. O(new values + words of dead bits).
void BrickBuilder::check_recent(const Brick& brick, uint32_t begin) const {
  LOCUS_DCHECK_CALL(brick.check_invariants());
  for (uint32_t slot = begin; slot < brick.recent_count; ++slot) {
    check_value(brick, *brick.recent, slot, GridSlot::kRecent);
    LOCUS_DCHECK(!brick.is_recent_dead(slot));
    LOCUS_DCHECK(planted(PlantedBug::kUnsignedCellIndex) ||
                 brick.geometry.nearly_holds(brick.recent->entry(slot).position));
  }
}

bool BrickBuilder::is_few(const Brick* old, absl::Span<const BrickChange> changes) {
  if (old == nullptr || old->sorted->count() < kMinSorted) return false;
  return changes.size() * kSortedPerChange <= old->sorted->count() &&
         old->recent_count + changes.size() <= old->recent_room() &&
         (old->dead_count + changes.size()) * kSortedPerDead <= old->sorted->count();
}

void BrickBuilder::mark_changes(const Brick& old, absl::Span<const BrickChange> changes) {
  sorted_changes_.assign(old.sorted->count(), kStays);
  recent_changes_.assign(old.recent_count, kStays);
  for (const BrickChange& change : changes) {
    if (arrives(change)) continue;
    if (change.index != BrickChange::kLeaves) __builtin_prefetch(&parts_.moves.moves[change.index]);
    const uint32_t slot = change.slot & ~GridSlot::kRecent;
    std::vector<uint32_t>& marks = (change.slot & GridSlot::kRecent) != 0 ? recent_changes_ : sorted_changes_;
    LOCUS_DCHECK_LT(slot, marks.size());
    LOCUS_DCHECK_EQ(marks[slot], kStays);
    marks[slot] = change.index;
  }
}

inline void BrickBuilder::add_source(const GridBlock& block, uint32_t origin, uint32_t change) {
  if (change == BrickChange::kLeaves) return;
  const bool stays = change == kStays;
  const Vec3d position =
      stays ? block.entry(origin & ~GridSlot::kRecent).position : parts_.moves.moves[change].position;
  sources_.push_back(
      {origin, stays ? BrickSource::kNoMove : change, static_cast<uint32_t>(geometry_->cell_of(position))});
}

void BrickBuilder::add_arrivals(absl::Span<const BrickChange> changes) {
  for (const BrickChange& change : changes) {
    if (!arrives(change)) continue;
    const Vec3d position = parts_.arrivals[change.index].entry.position;
    sources_.push_back({change.index | BrickSource::kArrival, BrickSource::kNoMove,
                        static_cast<uint32_t>(geometry_->cell_of(position))});
  }
}

GridForm BrickBuilder::form_of(const Brick* old, const BrickSource& source) const {
  if ((source.origin & BrickSource::kArrival) != 0) return parts_.arrivals[source.origin & ~BrickSource::kArrival].form;
  const GridBlock& block = (source.origin & GridSlot::kRecent) != 0 ? *old->recent : *old->sorted;
  GridForm form = block.form(source.origin & ~GridSlot::kRecent);
  if (source.move == BrickSource::kNoMove) return form;
  const uint32_t rotation = parts_.moves.moves[source.move].rotation;
  if (rotation != GridMove::kKeeps) form.rotation = parts_.moves.rotations[rotation];
  return form;
}

bool BrickBuilder::any_form_arrives(absl::Span<const BrickChange> changes) const {
  return std::any_of(changes.begin(), changes.end(), [this](const BrickChange& change) {
    return arrives(change) && !(parts_.arrivals[change.index].form == GridForm());
  });
}

bool BrickBuilder::any_form(const Brick* old, absl::Span<const BrickSource> sources) const {
  if (!parts_.moves.rotations.empty() || (old != nullptr && old->sorted->has_forms())) return true;
  // The sources of arrivals follow all other sources.
  for (size_t i = sources.size(); i != 0 && (sources[i - 1].origin & BrickSource::kArrival) != 0; --i)
    if (!(parts_.arrivals[sources[i - 1].origin & ~BrickSource::kArrival].form == GridForm())) return true;
  return false;
}

// Prefetches the memory that write() needs for `source`. from[0] and from[1] are the values of the old brick's sorted
// block and log.
inline void BrickBuilder::prefetch(const GridBlock::Values* from, const BrickSource& source) const {
  if (source.move != BrickSource::kNoMove) __builtin_prefetch(&parts_.moves.moves[source.move]);
  if ((source.origin & BrickSource::kArrival) != 0) return;
  const GridBlock::Values& values = from[source.origin >> 31];
  const uint32_t slot = source.origin & ~GridSlot::kRecent;
  __builtin_prefetch(&values.entries[slot]);
  __builtin_prefetch(&(*slots_)[values.handles[slot]], 1);
}

// Writes each source to the slot that slot_of(source) returns; slot_of() is called once per source, in order. `flag` is
// GridSlot::kRecent if `block` is a log, else 0.
template <class SlotOf>
inline void BrickBuilder::write(GridBlock& block, uint32_t flag, const Brick* old,
                                absl::Span<const BrickSource> sources, const SlotOf& slot_of) {
  const GridBlock::Places places(block, geometry_->center);
  // If the old brick or its log does not exist, `from` contains pointers to another block instead; no source refers to
  // them.
  const GridBlock& sorted = old == nullptr ? block : *old->sorted;
  const GridBlock::Values from[2] = {
      GridBlock::Values(sorted), GridBlock::Values(old == nullptr || old->recent == nullptr ? sorted : *old->recent)};
  const GridMove* const moves = parts_.moves.moves.data();
  GridSlot* const slots = slots_->data();
  const uint32_t index = index_;
  const bool has_forms = block.has_forms();
  float max_extent = max_extent_;
  for (size_t i = 0; i < sources.size(); ++i) {
    if (i + kPrefetchValues < sources.size()) prefetch(from, sources[i + kPrefetchValues]);
    const BrickSource source = sources[i];
    const uint32_t slot = slot_of(source);
    LOCUS_DCHECK_LT(slot, block.count());
    uint32_t handle = 0;
    if ((source.origin & BrickSource::kArrival) != 0) {
      const GridItem& arrival = parts_.arrivals[source.origin & ~BrickSource::kArrival];
      handle = arrival.handle;
      max_extent = std::max(max_extent, arrival.reach);
      places.put(slot, arrival.entry, arrival.entry.position, handle, arrival.reach);
    } else {
      const GridBlock::Values& values = from[source.origin >> 31];
      const uint32_t before = source.origin & ~GridSlot::kRecent;
      const GridEntry& entry = values.entries[before];
      handle = values.handles[before];
      const Vec3d position = source.move == BrickSource::kNoMove ? entry.position : moves[source.move].position;
      places.put(slot, entry, position, handle, values.extents[before]);
    }
    if (has_forms) block.put_form(slot, form_of(old, source));
    slots[handle] = {index, slot | flag};
  }
  max_extent_ = max_extent;
}

BrickPtr BrickBuilder::sort_anew(const Brick* old, absl::Span<const BrickChange> changes) {
  if (old != nullptr) {
    mark_changes(*old, changes);
    for (uint32_t slot = 0; slot < old->sorted->count(); ++slot)
      if (!old->is_dead(slot)) add_source(*old->sorted, slot, sorted_changes_[slot]);
    for (uint32_t slot = 0; slot < old->recent_count; ++slot)
      if (!old->is_recent_dead(slot)) add_source(*old->recent, slot | GridSlot::kRecent, recent_changes_[slot]);
  }
  add_arrivals(changes);
  return sorted_by_cell(old, sources_);
}

// Returns a version whose sorted block holds all sources, ordered by a counting sort by cell, and whose log is empty.
// Returns null if there are no sources.
BrickPtr BrickBuilder::sorted_by_cell(const Brick* old, absl::Span<const BrickSource> sources) {
  if (sources.empty()) return nullptr;
  const auto block = std::make_shared<GridBlock>(static_cast<uint32_t>(sources.size()), any_form(old, sources));
  std::array<uint32_t, kBrickCells + 1>& offsets = block->offsets();
  for (const BrickSource& source : sources) {
    LOCUS_DCHECK_LT(source.cell, uint32_t{kBrickCells});
    ++offsets[source.cell + 1];
  }
  for (size_t cell = 0; cell < kBrickCells; ++cell) offsets[cell + 1] += offsets[cell];
  std::array<uint32_t, kBrickCells + 1> next = offsets;
  write(*block, 0, old, sources, [&next](const BrickSource& source) { return next[source.cell]++; });
  return new_brick(block);
}

// Returns a version with the block `sorted`, which is complete, and without a log.
BrickPtr BrickBuilder::new_brick(std::shared_ptr<const GridBlock> sorted) const {
  auto brick = std::make_shared<Brick>();
  brick->geometry = *geometry_;
  brick->index = index_;
  brick->sorted = std::move(sorted);
  brick->max_extent = max_extent_;
  LOCUS_DCHECK_CALL(check_sorted(*brick));
  return brick;
}

BrickPtr BrickBuilder::rebuild(const Brick& old, const BrickGeometry& geometry, uint32_t index,
                               const BlockMoves& block_moves, absl::Span<const BrickChange> changes) {
  LOCUS_DCHECK(slots_ != nullptr && parts_.moves.rotations.empty());
  LOCUS_DCHECK(old.dead_count == 0 && old.recent_count == 0);
  LOCUS_DCHECK_EQ(block_moves.moves.size(), size_t{old.sorted->count()});
  LOCUS_DCHECK(std::all_of(changes.begin(), changes.end(), arrives));
  LOCUS_DCHECK_CALL(check_changes(&old, changes));
  geometry_ = &geometry;
  index_ = index;
  max_extent_ = old.max_extent;
  const GridBlock& from = *old.sorted;
  sources_.clear();
  add_arrivals(changes);
  std::array<uint32_t, kBrickCells + 1> offsets{};
  for (size_t cell = 0; cell < kBrickCells; ++cell) offsets[cell + 1] = from.offsets()[cell + 1] - from.offsets()[cell];
  for (const CellChange& change : block_moves.cell_changes) {
    --offsets[change.from + 1];
    if (change.to != CellChange::kLeaves) ++offsets[change.to + 1];
  }
  for (const BrickSource& source : sources_) ++offsets[source.cell + 1];
  for (size_t cell = 0; cell < kBrickCells; ++cell) offsets[cell + 1] += offsets[cell];
  if (offsets[kBrickCells] == 0) return nullptr;
  const auto block = std::make_shared<GridBlock>(offsets[kBrickCells], from.has_forms() || any_form_arrives(changes));
  block->offsets() = offsets;
  runs_.clear();
  find_runs(from, block_moves.cell_changes, offsets);
  for (const Run& run : runs_) copy_run(from, run, block_moves.moves, *block);
  write(*block, 0, &old, sources_, [&offsets](const BrickSource& source) { return offsets[source.cell]++; });
  return new_brick(block);
}

// Appends a run to runs_, or extends the last run.
inline void BrickBuilder::add_run(const Run& run) {
  if (!runs_.empty()) {
    Run& last = runs_.back();
    if (last.begin + last.count == run.begin && last.to + last.count == run.to) {
      last.count += run.count;
      return;
    }
  }
  runs_.push_back(run);
}

// Fills runs_ with the values of `from` that remain in the brick, in the order of a counting sort by cell. On input,
// next[cell] is the first slot of the cell in the new block; on output, it is the slot after the values of `from`.
void BrickBuilder::find_runs(const GridBlock& from, absl::Span<const CellChange> cell_changes,
                             std::array<uint32_t, kBrickCells + 1>& next) {
  if (cell_changes.empty() && next == from.offsets()) {
    runs_.push_back({0, 0, from.count()});
    return;
  }
  auto change = cell_changes.begin();
  uint32_t slot = 0;
  for (size_t cell = 0; cell < kBrickCells; ++cell) {
    const uint32_t end = from.offsets()[cell + 1];
    while (slot < end) {
      const bool stops = change != cell_changes.end() && change->slot < end;
      const uint32_t count = (stops ? change->slot : end) - slot;
      if (count != 0) add_run({slot, next[cell], count});
      next[cell] += count;
      slot += count;
      if (!stops) continue;
      LOCUS_DCHECK_EQ(size_t{change->from}, cell);
      if (change->to != CellChange::kLeaves) add_run({slot, next[change->to]++, 1});
      ++slot;
      ++change;
    }
  }
  LOCUS_DCHECK(change == cell_changes.end());
}

// Copies a run of values to `block`, with their new positions. `moves` are the moves of the slots of `from`.
inline void BrickBuilder::copy_run(const GridBlock& from, const Run& run, absl::Span<const uint32_t> moves,
                                   GridBlock& block) {
  block.copy_values(from, run.begin, run.to, run.count);
  const GridBlock::Places places(block, geometry_->center);
  const GridBlock::Values old_values(from);
  const GridMove* const all_moves = parts_.moves.moves.data();
  GridSlot* const slots = slots_->data();
  const uint32_t index = index_;
  const bool shifts = run.begin != run.to;
  for (uint32_t i = 0; i < run.count; ++i) {
    const uint32_t before = run.begin + i, slot = run.to + i;
    // The runs are almost in the order of the old slots, so the values that follow are in this run or in the next ones.
    if (before + kPrefetchValues < moves.size()) {
      const uint32_t next = moves[before + kPrefetchValues];
      if (next != BrickSource::kNoMove) __builtin_prefetch(&all_moves[next]);
      __builtin_prefetch(&old_values.entries[before + kPrefetchValues]);
      if (shifts) __builtin_prefetch(&slots[old_values.handles[before + kPrefetchValues]], 1);
    }
    const uint32_t move = moves[before];
    const GridEntry& entry = old_values.entries[before];
    const Vec3d& position = move == BrickSource::kNoMove ? entry.position : all_moves[move].position;
    places.put_entry(slot, entry, position);
    if (shifts) slots[old_values.handles[before]] = {index, slot};
  }
}

// Returns a version that shares both blocks of `old`: changed values are appended to the log after the slots of
// earlier versions, and their old slots are marked dead.
BrickPtr BrickBuilder::change_few(const Brick& old, absl::Span<const BrickChange> changes) {
  auto brick = std::make_shared<Brick>(old);
  if (brick->dead.empty()) brick->dead.resize(old.sorted->count() / 64 + 2);
  if (brick->recent == nullptr) brick->recent = std::make_shared<GridBlock>(old.recent_room(), old.sorted->has_forms());
  sources_.clear();
  for (const BrickChange& change : changes) {
    if (arrives(change)) {
      sources_.push_back({change.index | BrickSource::kArrival, BrickSource::kNoMove, 0});
      continue;
    }
    const bool recent = (change.slot & GridSlot::kRecent) != 0;
    const uint32_t slot = change.slot & ~GridSlot::kRecent;
    (recent ? brick->recent_dead.data() : brick->dead.data())[slot / 64] |= uint64_t{1} << (slot % 64);
    ++(recent ? brick->recent_dead_count : brick->dead_count);
    if (change.index != BrickChange::kLeaves) sources_.push_back({change.slot, change.index, 0});
  }
  write(*brick->recent, GridSlot::kRecent, &old, sources_, [&](const BrickSource&) { return brick->recent_count++; });
  brick->max_extent = max_extent_;
  if (brick->recent_count == 0) brick->recent = nullptr;
  if (brick->size() == 0) return nullptr;
  LOCUS_DCHECK_CALL(check_recent(*brick, old.recent_count));
  return brick;
}

}  // namespace locus::internal
