#include "core/index/hash_grid/grid_block.h"

#include <algorithm>
#include <cstring>

namespace locus::internal {

GridBlock::GridBlock(uint32_t count, bool has_forms) : count_(count), stride_((count + kLanes - 1) / kLanes * kLanes) {
  // A vector load that starts at the last value of the last float column reads beyond this column. The bytes after the
  // column are the handles and entries, so the load does not read beyond memory_.
  const size_t floats = size_t{4} * stride_ * sizeof(float);
  const size_t handles = size_t{stride_} * sizeof(uint32_t);
  const size_t entries = count * sizeof(GridEntry);
  bytes_ = floats + handles + entries + (has_forms ? count * sizeof(GridForm) : 0);
  memory_ = std::make_unique_for_overwrite<std::byte[]>(bytes_);
  floats_ = reinterpret_cast<float*>(memory_.get());
  handles_ = reinterpret_cast<uint32_t*>(memory_.get() + floats);
  entries_ = reinterpret_cast<GridEntry*>(memory_.get() + floats + handles);
  if (has_forms) forms_ = reinterpret_cast<GridForm*>(memory_.get() + floats + handles + entries);
  for (size_t column = 0; column < 4; ++column)
    std::fill(floats_ + column * stride_ + count, floats_ + (column + 1) * stride_, 0.0f);
  std::fill(handles_ + count, handles_ + stride_, ~0u);  // not a valid handle
}

void GridBlock::copy_values(const GridBlock& from, uint32_t begin, uint32_t to, uint32_t count) {
  LOCUS_DCHECK(begin <= from.count_ && count <= from.count_ - begin);
  LOCUS_DCHECK(to <= count_ && count <= count_ - to);
  LOCUS_DCHECK(has_forms() || !from.has_forms());
  std::memcpy(floats_ + size_t{3} * stride_ + to, from.floats_ + size_t{3} * from.stride_ + begin,
              count * sizeof(float));
  std::memcpy(handles_ + to, from.handles_ + begin, count * sizeof(uint32_t));
  if (!has_forms()) return;
  if (from.has_forms()) {
    std::memcpy(forms_ + to, from.forms_ + begin, count * sizeof(GridForm));
  } else {
    std::fill_n(forms_ + to, count, GridForm());
  }
}

void GridBlock::check_invariants() const {
  LOCUS_DCHECK_EQ(offsets_[0], 0u);
  LOCUS_DCHECK_EQ(offsets_[kBrickCells], count_);
  for (size_t cell = 0; cell < kBrickCells; ++cell) LOCUS_DCHECK_LE(offsets_[cell], offsets_[cell + 1]);
  LOCUS_DCHECK_EQ(stride_ % kLanes, 0u);
  for (uint32_t slot = count_; slot < stride_; ++slot)
    for (int axis = 0; axis < 4; ++axis) LOCUS_DCHECK_EQ(column(axis)[slot], 0.0f);
}

uint32_t GridBlock::find(uint32_t handle) const {
  uint32_t slot = 0;
  for (; slot + kLanes <= count_; slot += kLanes) {
    uint32_t equal = 0;
    for (uint32_t lane = 0; lane < kLanes; ++lane) equal |= handles_[slot + lane] == handle ? 1u : 0u;
    if (equal != 0) break;
  }
  while (slot < count_ && handles_[slot] != handle) ++slot;
  return slot;
}

uint32_t GridBlock::find_last(uint32_t handle, uint32_t count) const {
  LOCUS_DCHECK_LE(count, count_);
  for (uint32_t slot = count; slot != 0; --slot)
    if (handles_[slot - 1] == handle) return slot - 1;
  return count;
}

uint32_t GridBlock::find_near(uint32_t handle, uint32_t slot) const {
  constexpr uint32_t kSlots = 2 * kLanes;
  if (stride_ < kSlots) return find(handle);
  const uint32_t begin = std::min(slot < kLanes ? 0 : slot - kLanes, stride_ - kSlots);
  uint32_t position_plus_one = 0;  // 0 if `handle` is not found; a handle occurs at most once
  for (uint32_t i = 0; i < kSlots; ++i) position_plus_one |= handles_[begin + i] == handle ? i + 1 : 0;
  return position_plus_one == 0 ? count_ : begin + position_plus_one - 1;
}

}  // namespace locus::internal
