#include "core/index/hash_grid/hash_grid.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/base/planted_bug.h"
#include "core/base/scratch.h"
#include "core/index/hash_grid/cell_size.h"

namespace locus {
namespace {

constexpr size_t kChangesPerCheck = 64;    // changes per value, on average, before the cell size is checked again
constexpr size_t kRefiledPerBatch = 8192;  // min number of values that a batch moves to other levels
constexpr size_t kArrivalShare = 8;        // the density is counted again after size() / kArrivalShare arrivals,
constexpr double kMinArrivals = 32;        // but not before this many times HashGridOptions::min_brick_values

// Returns the number of values for each one from which the density of `values` values is estimated.
size_t values_per_sample(size_t values) { return values < 8192 ? 1 : 4; }

}  // namespace

using internal::BrickChange;
using internal::BrickGeometry;
using internal::DensityMap;
using internal::GridKey;
using internal::GridSlot;

HashGrid::HashGrid(const HashGridOptions& options)
    : density_(internal::exponent_covering(options.cell_size, internal::kMinCellExponent, internal::kMaxBaseExponent)),
      first_choice_(std::max<size_t>(options.first_choice, 1)),
      min_brick_values_(options.min_brick_values) {}

double HashGrid::cell_size() const { return std::ldexp(1.0, density_.base_exponent()); }

GridRef HashGrid::at(uint32_t handle) const {
  LOCUS_DCHECK_LT(handle, slots_.size());
  const GridSlot& slot = slots_[handle];
  const internal::Brick& brick = *bricks_[slot.brick];
  const bool recent = (slot.slot & GridSlot::kRecent) != 0;
  return {recent ? *brick.recent : *brick.sorted, slot.slot & ~GridSlot::kRecent, slot.brick};
}

// Checks that slots_[handle] is the location of a slot with this handle in an existing brick. O(1).
void HashGrid::check_in_use(uint32_t handle) const {
  if (planted(PlantedBug::kGhostAfterMove)) return;  // with this bug a handle has several slots
  LOCUS_DCHECK_LT(handle, slots_.size());
  LOCUS_DCHECK_LT(slots_[handle].brick, bricks_.size());
  LOCUS_DCHECK(bricks_[slots_[handle].brick] != nullptr);
  LOCUS_DCHECK_EQ(at(handle).handle(), handle);
}

// Checks the invariants of the class for the levels and for the bricks and values that the batch has changed. O(changes
// + levels).
void HashGrid::check_invariants(const GridBatch& batch) const {
  size_t values = 0, bricks = 0;
  for (size_t i = 0; i < levels_.size(); ++i) {
    if (i != 0) LOCUS_DCHECK_GT(levels_[i - 1]->exponent, levels_[i]->exponent);
    LOCUS_DCHECK_GT(levels_[i]->size, 0u);
    LOCUS_DCHECK_GT(levels_[i]->table->size(), 0u);
    values += levels_[i]->size;
    bricks += levels_[i]->table->size();
  }
  LOCUS_DCHECK_EQ(values, size_);
  LOCUS_DCHECK_EQ(bricks, brick_info_.size() - free_bricks_.size());
  LOCUS_DCHECK_EQ(touched_indices_.size(), brick_info_.size());
  for (const uint32_t brick : touched_) check_brick(brick);
  check_locations(batch);
}

// Checks that the version of a brick agrees with its entry in brick_info_ and with its level. Skips a dropped brick,
// which has no version. O(1).
void HashGrid::check_brick(uint32_t brick) const {
  if (bricks_[brick] == nullptr) return;
  const internal::Brick& version = *bricks_[brick];
  const BrickInfo& info = brick_info_[brick];
  LOCUS_DCHECK_EQ(version.index, brick);
  LOCUS_DCHECK(version.geometry.key == info.geometry.key);
  LOCUS_DCHECK_EQ(version.geometry.exponent, info.level->exponent);
  LOCUS_DCHECK_LE(double{version.max_extent}, info.level->max_extent);
  LOCUS_DCHECK(contains(info.level->bounds, Aabbd{version.geometry.low, version.geometry.high}) ||
               planted(PlantedBug::kSparseBrickBounds));
  const auto has_key = [&](uint32_t candidate) { return brick_info_[candidate].geometry.key == info.geometry.key; };
  LOCUS_DCHECK_EQ(info.level->table->find(info.geometry.key, has_key), brick);
}

// Checks the locations of the values that the batch has moved or inserted. O(changes).
void HashGrid::check_locations(const GridBatch& batch) const {
  if (planted(PlantedBug::kGhostAfterMove)) return;  // with this bug a handle has several slots
  const auto check = [this](uint32_t handle, Vec3d position) {
    LOCUS_DCHECK_CALL(check_in_use(handle));
    LOCUS_DCHECK(at(handle).entry().position == position);
    LOCUS_DCHECK_EQ(bricks_by_handle_[handle], slots_[handle].brick);
  };
  for (const GridMove& move : batch.moves.moves) check(move.handle, move.position);
  for (const GridItem& item : batch.inserted) check(item.handle, item.entry.position);
}

int HashGrid::exponent_for(float extent, Vec3d position) const {
  return internal::exponent_covering(2.0 * double{extent}, density_.exponent_at(position), internal::kMaxCellExponent);
}

HashGrid::Level& HashGrid::level_of(int exponent) {
  auto level = levels_.begin();
  while (level != levels_.end() && (*level)->exponent > exponent) ++level;
  if (level == levels_.end() || (*level)->exponent != exponent)
    level = levels_.insert(level, std::make_unique<Level>(exponent));
  return **level;
}

internal::BrickTable& HashGrid::writable_table(Level& level) {
  if (std::exchange(level.table_is_shared, false)) level.table = std::make_shared<internal::BrickTable>(*level.table);
  return *level.table;
}

uint32_t HashGrid::brick_for(Level& level, const GridKey& key) {
  const uint32_t found = level.table->find(key, [&](uint32_t brick) { return brick_info_[brick].geometry.key == key; });
  if (found != internal::BrickTable::kNone) return found;
  uint32_t brick = static_cast<uint32_t>(brick_info_.size());
  if (free_bricks_.empty()) {
    brick_info_.emplace_back();
    touched_indices_.push_back(0);
  } else {
    brick = free_bricks_.back();
    free_bricks_.pop_back();
  }
  brick_info_[brick] = {BrickGeometry::of(key, level.exponent), &level};
  bricks_.set(brick, nullptr);
  writable_table(level).insert(key, brick);
  const Vec3d half = Vec3d{1, 1, 1} * (brick_info_[brick].geometry.edge / 2);
  const Vec3d center = brick_info_[brick].geometry.center;
  level.bounds = merge(level.bounds, Aabbd{center - half, center + half});
  return brick;
}

// Looks for `brick` in touched_ at the index touched_indices_[brick]. If this index is left over from an earlier batch,
// touched_ has no entry or another brick there, so touched_indices_ need not be cleared between batches.
inline uint32_t HashGrid::touch(uint32_t brick) {
  const uint32_t known_index = touched_indices_[brick];
  if (known_index < touched_.size() && touched_[known_index] == brick) return known_index;
  touched_indices_[brick] = static_cast<uint32_t>(touched_.size());
  touched_.push_back(brick);
  change_counts_.push_back(0);
  return touched_indices_[brick];
}

void HashGrid::change(uint32_t brick, const BrickChange& change) {
  const uint32_t touched = touch(brick);
  ++change_counts_[touched];
  changes_.push_back({touched, change});
}

void HashGrid::remove(uint32_t handle) {
  LOCUS_CHECK_LT(handle, slots_.size());
  LOCUS_DCHECK_CALL(check_in_use(handle));
  const GridSlot slot = slots_[handle];
  --brick_info_[slot.brick].level->size;
  --size_;
  change(slot.brick, {slot.slot, BrickChange::kLeaves});
}

void HashGrid::insert(const GridItem& item) {
  LOCUS_DCHECK(max_component(abs(item.entry.position)) <= limits::kMaxCoordinate);
  Level& level = level_of(exponent_for(item.reach, item.entry.position));
  const uint32_t brick =
      brick_for(level, internal::brick_of(internal::cell_of(item.entry.position, level.cells_per_unit)));
  level.max_extent = std::max(level.max_extent, double{item.reach});
  ++level.size;
  ++size_;
  ++arrivals_since_count_;
  if (item.handle >= slots_.size()) slots_.resize(item.handle + 1);
  bricks_by_handle_.set(item.handle, brick);
  change(brick, {BrickChange::kArrives, static_cast<uint32_t>(arrivals_.size())});
  arrivals_.push_back(item);
}

// Moves a value to another brick.
void HashGrid::move_to_other_brick(const GridMove& move, const GridMoves& moves) {
  const GridItem item = at(move.handle).item();
  if (!planted(PlantedBug::kGhostAfterMove)) remove(move.handle);
  insert_moved(item, move, moves);
}

// Inserts the value `before` with the position of `move` and, if `move` has one, with its rotation.
void HashGrid::insert_moved(const GridItem& before, const GridMove& move, const GridMoves& moves) {
  GridItem item = before;
  item.entry.position = move.position;
  if (move.rotation != GridMove::kKeeps) item.form.rotation = moves.rotations[move.rotation];
  insert(item);
}

void HashGrid::move_all(const GridMoves& batch) {
  const absl::Span<const GridMove> moves = batch.moves;
  const size_t before = changes_.size();
  changes_.resize(before + moves.size());
  size_t changes = before;
  leaving_moves_.clear();
  for (size_t i = 0; i < moves.size(); ++i) {
    const GridMove& move = moves[i];
    LOCUS_DCHECK_CALL(check_in_use(move.handle));
    const GridSlot slot = slots_[move.handle];
    if (!brick_info_[slot.brick].geometry.holds(move.position)) {
      leaving_moves_.push_back(static_cast<uint32_t>(i));
      continue;
    }
    const uint32_t touched = touch(slot.brick);
    ++change_counts_[touched];
    changes_[changes++] = {touched, {slot.slot, static_cast<uint32_t>(i)}};
  }
  changes_.resize(changes);
  for (const uint32_t i : leaving_moves_) move_to_other_brick(moves[i], batch);
}

void HashGrid::group_changes() {
  LOCUS_DCHECK_EQ(change_counts_.size(), touched_.size());
  uint32_t begin = 0;
  for (uint32_t& count : change_counts_) begin += std::exchange(count, begin);
  grouped_.resize(changes_.size());
  for (const Change& change : changes_) grouped_[change_counts_[change.touched]++] = change.change;
}

void HashGrid::drop_brick(uint32_t brick) {
  Level& level = *brick_info_[brick].level;
  writable_table(level).erase(brick_info_[brick].geometry.key, brick);
  bricks_.set(brick, nullptr);
  free_bricks_.push_back(brick);
}

void HashGrid::rebuild_bricks(const GridMoves& moves) {
  builder_.begin({moves, arrivals_}, slots_);
  for (size_t i = 0; i < touched_.size(); ++i) {
    prefetch_changes(i);
    replace_brick(touched_[i], next_version(i));
  }
}

// Returns the next version of the brick touched_[touched], or null if no value remains in it.
internal::BrickPtr HashGrid::next_version(size_t touched) {
  const uint32_t brick = touched_[touched];
  const internal::Brick* const old = bricks_[brick].get();
  const BrickGeometry& geometry = brick_info_[brick].geometry;
  const GatheredBrick gathered = touched < gathered_.size() ? gathered_[touched] : GatheredBrick();
  const size_t count = gathered.end - gathered.begin;
  switch (gathered.how) {
    case GatheredBrick::How::kSources:
      return builder_.build(old, geometry, brick, absl::MakeConstSpan(sources_).subspan(gathered.begin, count),
                            changes_of(touched));
    case GatheredBrick::How::kMoves: {
      const auto moves = absl::MakeConstSpan(moves_by_slot_).subspan(gathered.first_move, old->sorted->count());
      const auto cell_changes = absl::MakeConstSpan(cell_changes_).subspan(gathered.begin, count);
      return builder_.rebuild(*old, geometry, brick, {moves, cell_changes}, changes_of(touched));
    }
    case GatheredBrick::How::kChanges:
      break;
  }
  return builder_.apply(old, geometry, brick, changes_of(touched));
}

void HashGrid::replace_brick(uint32_t brick, internal::BrickPtr next) {
  if (const internal::Brick* old = bricks_[brick].get(); old != nullptr)
    replaced_bytes_ += old->unshared_bytes(next.get());
  if (next == nullptr) {
    drop_brick(brick);
  } else {
    bricks_.set(brick, std::move(next));
  }
}

// Returns the changes of the brick touched_[touched].
absl::Span<const BrickChange> HashGrid::changes_of(size_t touched) const {
  LOCUS_DCHECK_LT(touched, touched_.size());
  const uint32_t begin = touched == 0 ? 0 : change_counts_[touched - 1];
  return absl::MakeConstSpan(grouped_).subspan(begin, change_counts_[touched] - begin);
}

// Prefetches the memory of bricks that follow touched_[touched]. Scattered changes miss the caches, so the memory of
// the next bricks is requested while earlier bricks are processed.
void HashGrid::prefetch_changes(size_t touched) const {
  constexpr size_t kBrickAhead = 12, kBlocksAhead = 8, kValuesAhead = 4;
  const auto brick_at = [this](size_t index) {
    return index < touched_.size() ? bricks_[touched_[index]].get() : nullptr;
  };
  if (const internal::Brick* brick = brick_at(touched + kBrickAhead); brick != nullptr) brick->prefetch();
  if (const internal::Brick* brick = brick_at(touched + kBlocksAhead); brick != nullptr) brick->prefetch_blocks();
  const internal::Brick* const brick = brick_at(touched + kValuesAhead);
  if (brick == nullptr) return;
  for (const BrickChange& change : changes_of(touched + kValuesAhead)) {
    if (change.slot == BrickChange::kArrives) continue;
    const uint32_t slot = change.slot & ~GridSlot::kRecent;
    ((change.slot & GridSlot::kRecent) != 0 ? *brick->recent : *brick->sorted).prefetch_value(slot);
  }
  if (brick->recent != nullptr && brick->recent_count < brick->recent_room())
    brick->recent->prefetch_target(brick->recent_count);
}

void HashGrid::apply_to_bricks(const GridBatch& batch) {
  touched_.clear();
  change_counts_.clear();
  for (const uint32_t handle : batch.removed) {
    const auto has_handle = [handle](const GridItem& item) { return item.handle == handle; };
    if (planted(PlantedBug::kGhostAfterMove) && std::any_of(batch.inserted.begin(), batch.inserted.end(), has_handle))
      continue;
    remove(handle);
  }
  if (moves_at_least_half(batch)) {
    gather_all(batch.moves);
  } else {
    move_all(batch.moves);
  }
  for (const GridItem& item : batch.inserted) insert(item);
  group_changes();
  rebuild_bricks(batch.moves);
  clear_batch();
  std::erase_if(levels_, [](const std::unique_ptr<Level>& level) { return level->size == 0; });
  LOCUS_DCHECK_CALL(check_invariants(batch));
}

void HashGrid::clear_batch() {
  clear_scratch(changes_);
  clear_scratch(grouped_);
  clear_scratch(arrivals_);
  clear_scratch(gathered_);
  clear_scratch(sources_);
  clear_scratch(moves_by_slot_);
  clear_scratch(cell_changes_);
  clear_scratch(cells_);
  builder_.end();
}

bool HashGrid::moves_at_least_half(const GridBatch& batch) const {
  const size_t moves = batch.moves.moves.size();
  return !batch.moves.by_handle.empty() && batch.removed.empty() && batch.inserted.empty() && moves != 0 &&
         moves >= size_ / 2;
}

// Has the same effect as move_all(), but iterates over the bricks and looks up the move of each value. Used if the
// batch contains only moves, of at least half of all values, and GridMoves::by_handle is given. The values of a brick
// are adjacent in memory, so the moves need not be grouped by brick.
void HashGrid::gather_all(const GridMoves& moves) {
  const internal::MoveFinder finder(moves);
  moves_by_slot_.reserve(size_);
  const auto bricks =
      static_cast<uint32_t>(brick_info_.size());  // bricks that insert_moved() creates later hold arrivals only
  for (uint32_t index = 0; index < bricks; ++index) {
    const internal::Brick* const brick = bricks_[index].get();
    if (brick == nullptr) continue;
    Level& level = *brick_info_[index].level;
    const auto leave = [&](const internal::GridBlock& block, uint32_t slot, const GridMove& move) {
      --level.size;
      --size_;
      insert_moved(block.item(slot), move, moves);
    };
    GatheredBrick gathered;
    if (gather(*brick, finder, moves.rotations.empty(), gathered, leave) == 0) continue;
    const uint32_t touched = touch(index);
    if (gathered_.size() <= touched) gathered_.resize(touched + 1);
    gathered_[touched] = gathered;
  }
  gathered_.resize(touched_.size());
}

// Finds the moves of the values of one brick. Calls leave(block, slot, move) for each value that moves out of the
// brick. Returns the number of values that move. `keeps_rotations` is true if the batch sets no rotation.
template <class Leave>
size_t HashGrid::gather(const internal::Brick& brick, const internal::MoveFinder& finder, bool keeps_rotations,
                        GatheredBrick& gathered, const Leave& leave) {
  if (keeps_rotations && brick.dead_count == 0 && brick.recent_count == 0) {
    gathered = {GatheredBrick::How::kMoves, cell_changes_.size(), 0, moves_by_slot_.size()};
    const uint32_t count = brick.sorted->count();
    cells_.resize(std::max(cells_.size(), size_t{count} + internal::kCellsPerStore));
    internal::write_cells(*brick.sorted, cells_.data());
    moves_by_slot_.resize(gathered.first_move + count);
    const size_t moved = internal::find_moves(brick, cells_.data(), finder, moves_by_slot_.data() + gathered.first_move,
                                              cell_changes_, leave);
    if (moved == 0) moves_by_slot_.resize(gathered.first_move);
    gathered.end = cell_changes_.size();
    return moved;
  }
  gathered = {GatheredBrick::How::kSources, sources_.size(), 0, 0};
  sources_.resize(gathered.begin + brick.size());
  size_t moved = 0;
  const internal::BrickSource* const end =
      internal::gather_brick(brick, finder, sources_.data() + gathered.begin, moved, leave);
  gathered.end = moved == 0 ? gathered.begin : static_cast<size_t>(end - sources_.data());
  sources_.resize(gathered.end);
  return moved;
}

size_t HashGrid::apply(const GridBatch& batch) {
  replaced_bytes_ = 0;
  // Choose the cell size before a bulk load, so that the load stores each value only once.
  if (size_ == 0 && batch.inserted.size() >= first_choice_) {
    internal::EvenSample sample(batch.inserted.size());
    for (const GridItem& item : batch.inserted) sample.offer(item.entry.position, 2.0 * double{item.reach});
    const int base = has_fixed_size_ ? density_.base_exponent()
                                     : internal::choose_cell_exponent(sample.values(), batch.inserted.size());
    estimate_density(batch.inserted, base, sample.bounds());
    size_at_choice_ = batch.inserted.size();
    changes_since_choice_ = 0;
  }
  apply_to_bricks(batch);
  arrivals_since_count_ += batch.removed.size();
  const size_t changes = batch.removed.size() + batch.moves.moves.size() + batch.inserted.size();
  changes_since_choice_ += changes;
  if (stale_bricks_.empty() && !has_fixed_size_ && choice_is_stale()) choose_cell_size();
  if (stale_bricks_.empty() && density_is_stale()) count_density();
  if (!stale_bricks_.empty()) refile(std::max(changes, kRefiledPerBatch));
  return replaced_bytes_;
}

void HashGrid::fix_cell_size(double cell_size) {
  has_fixed_size_ = cell_size > 0;
  // 0 makes the choice of an unfixed size stale. A fixed size counts as chosen, so that the density is counted.
  size_at_choice_ = has_fixed_size_ ? std::max<size_t>(size_, 1) : 0;
  if (!has_fixed_size_) return;
  const int exponent = internal::exponent_covering(cell_size, internal::kMinCellExponent, internal::kMaxBaseExponent);
  if (exponent == density_.base_exponent()) return;
  Aabbd bounds;
  for (const std::unique_ptr<Level>& level : levels_) bounds = merge(bounds, level->bounds);
  if (size_ == 0) {
    density_ = DensityMap(exponent);
  } else {
    change_base(exponent, bounds);
  }
}

void HashGrid::fill(absl::Span<const GridItem> items, double cell_size) {
  LOCUS_CHECK_EQ(size_, 0u);
  const int base = has_fixed_size_
                       ? density_.base_exponent()
                       : internal::exponent_covering(cell_size, internal::kMinCellExponent, internal::kMaxBaseExponent);
  density_ = DensityMap(base);
  if (items.size() >= first_choice_) {
    size_at_choice_ = items.size();
    internal::EvenSample sample(items.size());
    for (const GridItem& item : items) sample.offer(item.entry.position, 2.0 * double{item.reach});
    estimate_density(items, base, sample.bounds());
  }
  changes_since_choice_ = 0;
  apply_to_bricks({{}, {}, items});
}

// Makes the density map of an empty grid from a sample of the values that it will have.
void HashGrid::estimate_density(absl::Span<const GridItem> items, int base_exponent, const Aabbd& bounds) {
  internal::DensityCount count(base_exponent, bounds);
  const size_t stride = values_per_sample(items.size());
  for (size_t i = 0; i < items.size(); i += stride) count.add(items[i].entry.position, static_cast<double>(stride));
  density_ = count.map(min_brick_values_, nullptr);
  density_is_estimated_ = true;
}

bool HashGrid::choice_is_stale() const {
  return size_ >= first_choice_ && (size_ >= 2 * size_at_choice_ || size_ <= size_at_choice_ / 8 ||
                                    changes_since_choice_ >= kChangesPerCheck * size_);
}

void HashGrid::choose_cell_size() {
  const bool similar_size = size_ < 2 * size_at_choice_ && size_ > size_at_choice_ / 8;
  internal::EvenSample sample(size_);
  for_each([&sample](const GridRef& value) {
    sample.offer(value.entry().position, 2.0 * double{value.reach()});
    return true;
  });
  changes_since_choice_ = 0;
  const int base = density_.base_exponent();
  if (similar_size && internal::cell_exponent_fits(sample.values(), size_, base)) return;
  size_at_choice_ = size_;
  const int exponent = internal::choose_cell_exponent(sample.values(), size_);
  if (exponent != base) change_base(exponent, sample.bounds());
}

void HashGrid::change_base(int exponent, const Aabbd& bounds) {
  internal::DensityCount count(exponent, bounds);
  const size_t stride = values_per_sample(size_);
  size_t index = 0;
  for_each([&](const GridRef& value) {
    if (index++ % stride == 0) count.add(value.entry().position, static_cast<double>(stride));
    return true;
  });
  density_is_estimated_ = true;
  start_refiling(count.map(min_brick_values_, nullptr));
}

bool HashGrid::density_is_stale() const {
  const auto min_arrivals = static_cast<size_t>(kMinArrivals * min_brick_values_);
  return size_at_choice_ != 0 && size_ >= first_choice_ &&
         arrivals_since_count_ >= std::max(min_arrivals, size_ / kArrivalShare);
}

// Makes a density map of the present values. O(bricks). A node that was dense by an estimate alone needs as many values
// as any other to remain dense.
void HashGrid::count_density() {
  measure_levels();
  arrivals_since_count_ = 0;
  Aabbd bounds;
  for (const std::unique_ptr<Level>& level : levels_) bounds = merge(bounds, level->bounds);
  internal::DensityCount count(density_.base_exponent(), bounds);
  for (uint32_t brick = 0; brick < brick_info_.size(); ++brick)
    if (bricks_[brick] != nullptr) count.add(*bricks_[brick]);
  start_refiling(count.map(min_brick_values_, std::exchange(density_is_estimated_, false) ? nullptr : &density_));
}

// Computes the bounds and the extents of all levels again. They grow with each value that arrives, so they are too
// large after values have left. O(bricks).
void HashGrid::measure_levels() {
  for (const std::unique_ptr<Level>& level : levels_) {
    level->bounds = Aabbd();
    level->max_extent = 0;
    level->table->for_each([&](uint32_t brick) {
      const BrickGeometry& geometry = brick_info_[brick].geometry;
      const bool forgotten = planted(PlantedBug::kSparseBrickBounds) && geometry.exponent > density_.base_exponent();
      level->bounds = merge(level->bounds,
                            forgotten ? Aabbd{geometry.center, geometry.center} : Aabbd{geometry.low, geometry.high});
      level->max_extent = std::max(level->max_extent, double{bricks_[brick]->max_extent});
      return true;
    });
  }
}

// Begins to store values by the map `density`: adds to stale_bricks_ all bricks with values that may belong on another
// level, sorted so that neighbouring bricks are adjacent, because their values move to the same new bricks. The sort
// order is descending, because refile() removes bricks from the end of stale_bricks_.
void HashGrid::start_refiling(DensityMap density) {
  const bool same_base = density.base_exponent() == density_.base_exponent();
  if (!same_base) stale_bricks_.clear();  // all bricks are added below
  for (uint32_t brick = 0; brick < brick_info_.size(); ++brick) {
    if (bricks_[brick] == nullptr) continue;
    const BrickGeometry& geometry = brick_info_[brick].geometry;
    if (!same_base || density.differs(density_, geometry.key, geometry.exponent)) stale_bricks_.push_back(brick);
  }
  density_ = std::move(density);
  const auto order = [this](uint32_t brick) {
    const GridKey& key = brick_info_[brick].geometry.key;
    constexpr int kGroupBits = 2;  // groups of 4x4x4 bricks
    return std::pair(GridKey{key.x >> kGroupBits, key.y >> kGroupBits, key.z >> kGroupBits}, key);
  };
  std::sort(stale_bricks_.begin(), stale_bricks_.end(), [&](uint32_t a, uint32_t b) { return order(b) < order(a); });
}

// Moves values from the bricks in stale_bricks_ to the levels on which density_ places them, a whole brick at a time,
// until at least `max_values` values have moved or stale_bricks_ is empty.
void HashGrid::refile(size_t max_values) {
  std::vector<uint32_t> leaving;
  std::vector<GridItem> items;
  while (!stale_bricks_.empty() && items.size() < max_values) {
    const uint32_t index = stale_bricks_.back();
    stale_bricks_.pop_back();
    const internal::Brick* const brick = bricks_[index].get();
    if (brick == nullptr) continue;
    const int exponent = brick->geometry.exponent;
    internal::for_each_value(*brick, [&](const GridRef& value) {
      if (exponent_for(value.reach(), value.entry().position) == exponent) return true;
      leaving.push_back(value.handle());
      items.push_back(value.item());
      return true;
    });
  }
  if (!items.empty()) apply_to_bricks({leaving, {}, items});
  if (!stale_bricks_.empty()) return;
  std::vector<uint32_t>().swap(stale_bricks_);
  measure_levels();
}

GridSnapshot HashGrid::snapshot() {
  std::vector<internal::GridLevel> levels;
  levels.reserve(levels_.size());
  for (const std::unique_ptr<Level>& level : levels_) {
    level->table_is_shared = true;
    const double epsilon = internal::kBoundsGrowth * (level->max_extent + magnitude(level->bounds));
    const double max_extent = level->max_extent + epsilon;
    levels.push_back({level->exponent,
                      {grown(level->bounds, max_extent), max_extent, level->cells_per_unit},
                      level->size,
                      level->table});
  }
  return {std::move(levels), bricks_.snapshot(), bricks_by_handle_.snapshot(), cell_size()};
}

}  // namespace locus
