// The writing half of HashGrid; included by hash_grid.h only.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_HASH_GRID_IMPL_H_
#define LOCUS_CORE_INDEX_HASH_GRID_HASH_GRID_IMPL_H_

#include "core/index/hash_grid/hash_grid.h"

namespace locus {

namespace internal {
// The leading elements of `all` that `same` as its first, which are taken off it.
template <class T, class Same>
absl::Span<const T> take_group(absl::Span<const T>& all, const Same& same) {
  size_t end = 1;
  while (end < all.size() && same(all[end], all[0])) ++end;
  const absl::Span<const T> group = all.subspan(0, end);
  all.remove_prefix(end);
  return group;
}

// Every value whose turn it is in an even selection of about kCellSizeSample of `population`.
class EvenSample {
 public:
  explicit EvenSample(size_t population) : stride_(std::max<size_t>(1, population / kCellSizeSample)) {}
  template <Bounded V>
  void offer(const V& value) {
    if (offered_++ % stride_ != 0) return;
    const Aabbd bounds = PrimitiveTraits<V>::bounds(value);
    values_.push_back({PrimitiveTraits<V>::position(value), max_component(bounds.extent())});
  }
  absl::Span<const SampledValue> values() const { return values_; }

 private:
  size_t stride_;
  size_t offered_ = 0;
  std::vector<SampledValue> values_;
};
}  // namespace internal

template <Bounded V>
typename HashGrid<V>::Place HashGrid<V>::place_of(const V& value) const {
  const Vec3d position = Traits::position(value);
  LOCUS_DCHECK(max_component(abs(position)) <= limits::kMaxCoordinate);
  const double reach = internal::reach_of(Traits::bounds(value), position);
  const int exponent = internal::exponent_covering(2 * reach, base_exponent_, internal::kMaxCellExponent);
  const internal::GridKey cell = internal::cell_of(position, internal::cells_per_unit(exponent));
  return {exponent, internal::brick_of(cell), internal::number_in_brick(cell)};
}

template <Bounded V>
const typename HashGrid<V>::Level* HashGrid<V>::find_level(int exponent) const {
  for (const Level& level : levels_) {
    if (level.exponent() == exponent) return &level;
  }
  return nullptr;
}

template <Bounded V>
typename HashGrid<V>::Level& HashGrid<V>::level_for(int exponent) {
  auto at = levels_.begin();
  while (at != levels_.end() && at->exponent() > exponent) ++at;
  if (at == levels_.end() || at->exponent() != exponent) at = levels_.insert(at, Level(exponent));
  return *at;
}

template <Bounded V>
bool HashGrid<V>::contains(const V& value) const {
  const Place place = place_of(value);
  const Level* level = find_level(place.exponent);
  const Brick* brick = level == nullptr ? nullptr : level->find(place.brick);
  const typename Brick::Cell* cell = brick == nullptr ? nullptr : brick->cell(place.cell);
  return cell != nullptr && std::any_of(cell->begin(), cell->end(), [&value](const auto& entry) {
           return Traits::id(entry.value) == Traits::id(value);
         });
}

template <Bounded V>
void HashGrid<V>::apply(absl::Span<const V> removed, absl::Span<const V> inserted) {
  if (size_ == 0 && inserted.size() >= first_choice_) {  // files a bulk load once, at the right size
    internal::EvenSample sample(inserted.size());
    for (const V& value : inserted) sample.offer(value);
    base_exponent_ = internal::choose_cell_exponent(sample.values(), inserted.size());
    size_at_choice_ = inserted.size();
    changes_since_choice_ = 0;
  }
  apply_sorted(changes_of(removed, inserted));
  changes_since_choice_ += removed.size() + inserted.size();
  if (choice_is_stale()) choose_cell_size();
}

template <Bounded V>
std::vector<typename HashGrid<V>::Change> HashGrid<V>::changes_of(absl::Span<const V> removed,
                                                                  absl::Span<const V> inserted) const {
  std::vector<Change> changes;
  changes.reserve(removed.size() + inserted.size());
  for (const V& value : removed) changes.push_back({place_of(value), false, &value});
  for (const V& value : inserted) changes.push_back({place_of(value), true, &value});
  if (planted(PlantedBug::kGhostAfterMove)) leave_ghosts(changes);
  std::stable_sort(changes.begin(), changes.end());
  return changes;
}

template <Bounded V>
void HashGrid<V>::leave_ghosts(std::vector<Change>& changes) const {
  absl::flat_hash_map<uint64_t, Place> moved_to;
  for (const Change& change : changes) {
    if (change.inserts) moved_to.emplace(Traits::id(*change.value), change.place);
  }
  std::erase_if(changes, [&moved_to](const Change& change) {
    const auto moved = moved_to.find(Traits::id(*change.value));
    return !change.inserts && moved != moved_to.end() && moved->second != change.place;
  });
}

template <Bounded V>
void HashGrid<V>::apply_sorted(Changes changes) {
  while (!changes.empty()) {
    Changes in_level = internal::take_group(
        changes, [](const Change& a, const Change& b) { return a.place.exponent == b.place.exponent; });
    Level& level = level_for(in_level[0].place.exponent);
    while (!in_level.empty()) {
      apply_to_brick(level, internal::take_group(in_level, [](const Change& a, const Change& b) {
                       return a.place.brick == b.place.brick;
                     }));
    }
  }
  std::erase_if(levels_, [](const Level& level) { return level.size() == 0; });
}

template <Bounded V>
void HashGrid<V>::apply_to_brick(Level& level, Changes changes) {
  const internal::GridKey key = changes[0].place.brick;
  const Brick* before = level.find(key);
  Brick brick = before == nullptr ? Brick() : *before;
  std::vector<uint64_t> removed;
  std::vector<const V*> inserted;
  size_t total_removed = 0;
  const size_t total = changes.size();
  while (!changes.empty()) {
    const Changes in_cell =
        internal::take_group(changes, [](const Change& a, const Change& b) { return a.place.cell == b.place.cell; });
    removed.clear();
    inserted.clear();
    for (const Change& change : in_cell) {
      if (change.inserts) {
        inserted.push_back(change.value);
        const Aabbd bounds = Traits::bounds(*change.value);
        level.extend(bounds, internal::reach_of(bounds, Traits::position(*change.value)));
      } else {
        removed.push_back(Traits::id(*change.value));
      }
    }
    std::sort(removed.begin(), removed.end());
    total_removed += removed.size();
    const int number = in_cell[0].place.cell;
    brick.replace_cell(number, internal::updated_cell<V>(brick.cell(number), removed, inserted));
  }
  const size_t total_inserted = total - total_removed;
  level.replace(key, std::move(brick), total_inserted, total_removed);
  size_ = size_ + total_inserted - total_removed;
}

template <Bounded V>
bool HashGrid<V>::choice_is_stale() const {
  if (size_ < first_choice_) return false;
  return size_ >= 2 * size_at_choice_ || size_ <= size_at_choice_ / 8 || changes_since_choice_ >= 16 * size_;
}

template <Bounded V>
void HashGrid<V>::choose_cell_size() {
  internal::EvenSample sample(size_);
  for_each([&sample](const V& value) { sample.offer(value); });
  const int exponent = internal::choose_cell_exponent(sample.values(), size_);
  size_at_choice_ = size_;
  changes_since_choice_ = 0;
  if (exponent != base_exponent_) rebuild(exponent);
}

template <Bounded V>
void HashGrid<V>::rebuild(int base_exponent) {
  std::vector<V> values;
  values.reserve(size_);
  for_each([&values](const V& value) { values.push_back(value); });
  base_exponent_ = base_exponent;
  levels_.clear();
  size_ = 0;
  apply_sorted(changes_of({}, values));
}

template <Bounded V>
template <class Fn>
void HashGrid<V>::for_each(Fn&& fn) const {
  for (const Level& level : levels_) {
    level.for_each_brick([&fn](const internal::GridKey&, const Brick& brick) {
      for (const typename Brick::Slot& slot : brick.slots) {
        for (const typename Brick::Entry& entry : *slot.cell) fn(entry.value);
      }
    });
  }
}

template <Bounded V>
HashGridStatistics HashGrid<V>::statistics() const {
  HashGridStatistics result;
  result.values = size_;
  result.levels = levels_.size();
  result.cell_size = std::ldexp(1.0, base_exponent_);
  for (const Level& level : levels_) {
    result.bricks += level.bricks();
    level.for_each_brick([&result](const internal::GridKey&, const Brick& brick) {
      result.cells += brick.slots.size();
      result.bytes += sizeof(Brick) + brick.slots.capacity() * sizeof(typename Brick::Slot);
      for (const typename Brick::Slot& slot : brick.slots) {
        result.bytes += sizeof(*slot.cell) + slot.cell->capacity() * sizeof(typename Brick::Entry);
      }
    });
  }
  return result;
}

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_HASH_GRID_HASH_GRID_IMPL_H_
