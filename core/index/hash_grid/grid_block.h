// Block: values of one brick of the hash grid, in columns. Float columns, relative to the centre of the brick, are used
// to cull eight values at a time. The exact position in double and the other members of a value are stored as one
// entry.
//
// Threads: immutable once shared; any thread. A log is the exception: its single writer appends values after the slots
// that earlier versions of the brick use, while readers of these versions read the same memory.
//
// Invariants: in a sorted block values are ordered by cell, and the values of cell c occupy the slots offsets[c] to
// offsets[c + 1] - 1; in a log values are in order of arrival. Float columns are padded with zeros to whole vectors of
// eight floats, and a vector load may start at any value.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_GRID_BLOCK_H_
#define LOCUS_CORE_INDEX_HASH_GRID_GRID_BLOCK_H_

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "core/base/check.h"
#include "core/base/ids.h"
#include "core/geometry/shape.h"

namespace locus {

// Value as the grid stores it, without its form (GridForm), its extent and its handle, which have columns of their own.
struct GridEntry {
  Vec3d position;
  Id id = kNoId;
  Group group = 0;
  Tag tag = 0;
  Layers layers = kDefaultLayers;
  ShapeKind kind = ShapeKind::kPoint;
};
static_assert(sizeof(GridEntry) == 56);

class Compound;

// Rotation, size and radius of a shape, as in Shape. Most values have the default form, so a block may omit the forms
// if all its values have the default form.
struct GridForm {
  Quaternion rotation;
  Vec3f size;
  float radius = 0;  // 0 for balls, whose radius is their extent

  // Return the form of a compound, which stores the address of the compound in place of a size, and this address. So
  // the form of every shape has 32 bytes. A form does not own its compound.
  static GridForm of_compound(const Quaternion& rotation, const Compound* compound) {
    const auto halves = std::bit_cast<std::array<float, 2>>(compound);
    return {rotation, {1, halves[0], halves[1]}, 0};  // the 1 distinguishes the form from the default form
  }
  const Compound* compound() const { return std::bit_cast<const Compound*>(std::array<float, 2>{size.y, size.z}); }

  friend constexpr bool operator==(const GridForm&, const GridForm&) = default;
};

// Value with all its parts, for example as the argument of an insertion. `handle` is the identifier that the caller
// assigned. `reach` is the extent of the value: an upper bound of the distance from its position to any of its
// points, and so of the distance to its bounds along any axis, under any rotation. It does not include the growth of
// bounds_of() that covers rounding. The `reach` of a ball is exactly its radius.
struct GridItem {
  GridEntry entry;
  uint32_t handle = 0;
  float reach = 0;
  GridForm form;
};

namespace internal {

inline constexpr int kBrickCells = 64;

class GridBlock {
 public:
  static constexpr uint32_t kLanes = 8;

  // Allocates `count` slots. The caller writes each slot once by Places::put(), before it shares the block or, in a
  // log, before it shares a brick version whose recent_count includes the slot.
  GridBlock(uint32_t count, bool has_forms);

  uint32_t count() const { return count_; }
  bool has_forms() const { return forms_ != nullptr; }
  // Returns a float column. Columns 0 to 2 are x, y and z relative to the centre of the brick; column 3 is the extent.
  const float* column(int index) const {
    LOCUS_DCHECK(0 <= index && index < 4);
    return floats_ + size_t{stride_} * static_cast<size_t>(index);
  }
  // Return one part of the value in `slot`. Precondition: slot < count().
  const GridEntry& entry(uint32_t slot) const {
    LOCUS_DCHECK_LT(slot, count_);
    return entries_[slot];
  }
  float extent(uint32_t slot) const {
    LOCUS_DCHECK_LT(slot, count_);
    return column(3)[slot];
  }
  GridForm form(uint32_t slot) const {
    LOCUS_DCHECK_LT(slot, count_);
    return forms_ == nullptr ? GridForm() : forms_[slot];
  }
  uint32_t handle(uint32_t slot) const {
    LOCUS_DCHECK_LT(slot, count_);
    return handles_[slot];
  }
  GridItem item(uint32_t slot) const { return {entry(slot), handle(slot), extent(slot), form(slot)}; }
  // Returns the slot of `handle`, or count() if the block does not contain it. O(count), a vector at a time.
  uint32_t find(uint32_t handle) const;
  // Returns the last slot of `handle` among the first `count` slots of a log, or `count` if these slots do not contain
  // the handle.
  uint32_t find_last(uint32_t handle, uint32_t count) const;
  // Searches the 16 slots around `slot`, or the whole block if it has at most eight slots. Returns the slot of
  // `handle`, or count() if the searched slots do not contain the handle.
  uint32_t find_near(uint32_t handle, uint32_t slot) const;

  std::array<uint32_t, kBrickCells + 1>& offsets() { return offsets_; }
  const std::array<uint32_t, kBrickCells + 1>& offsets() const { return offsets_; }

  // Prefetch the memory of a slot: prefetch_entry() loads its entry, which usually spans two cache lines;
  // prefetch_value() also loads its handle and extent; prefetch_target() loads all columns that Places::put() writes.
  [[gnu::always_inline]] void prefetch_entry(uint32_t slot) const {
    const char* const entry = reinterpret_cast<const char*>(&entries_[slot]);
    __builtin_prefetch(entry);
    __builtin_prefetch(entry + sizeof(GridEntry) - 1);
  }
  [[gnu::always_inline]] void prefetch_value(uint32_t slot) const {
    prefetch_entry(slot);
    __builtin_prefetch(&handles_[slot]);
    __builtin_prefetch(&column(3)[slot]);
  }
  [[gnu::always_inline]] void prefetch_target(uint32_t slot) const {
    for (int axis = 0; axis < 3; ++axis) __builtin_prefetch(&column(axis)[slot], 1);
    prefetch_value(slot);
  }

  // Prefetches the handles that find_near() reads for the slots from `begin` to `end` - 1, which may be larger than
  // count().
  [[gnu::always_inline]] void prefetch_handles(uint32_t begin, uint32_t end) const {
    const uint32_t first = begin < kLanes ? 0 : begin - kLanes, last = std::min(end + kLanes, stride_);
    for (uint32_t slot = first; slot < last; slot += 2 * kLanes) __builtin_prefetch(&handles_[slot]);
    if (first < last) __builtin_prefetch(&handles_[last - 1]);
  }

  // Pointers to the columns of a block for reading. A loop can keep these pointers in registers.
  struct Values {
    explicit Values(const GridBlock& block)
        : entries(block.entries_), handles(block.handles_), extents(block.column(3)) {}

    const GridEntry* entries;
    const uint32_t* handles;
    const float* extents;
  };
  // Pointers to the columns of a block for writing.
  class Places {
   public:
    explicit Places(const GridBlock& block, Vec3d center)
        : x_(block.floats_),
          y_(x_ + block.stride_),
          z_(y_ + block.stride_),
          extent_(z_ + block.stride_),
          handles_(block.handles_),
          entries_(block.entries_),
          center_(center) {}

    // Writes one slot: all members of `entry` except its position, and the given position, handle and extent.
    void put(uint32_t slot, const GridEntry& entry, Vec3d position, uint32_t handle, float extent) const {
      extent_[slot] = extent;
      handles_[slot] = handle;
      put_entry(slot, entry, position);
    }
    // Writes the entry and the float columns of the position of a slot: all members of `entry` except its position, and
    // the given position.
    void put_entry(uint32_t slot, const GridEntry& entry, Vec3d position) const {
      x_[slot] = static_cast<float>(position.x - center_.x);
      y_[slot] = static_cast<float>(position.y - center_.y);
      z_[slot] = static_cast<float>(position.z - center_.z);
      entries_[slot] = entry;
      entries_[slot].position = position;
    }

   private:
    float *x_, *y_, *z_, *extent_;
    uint32_t* handles_;
    GridEntry* entries_;
    Vec3d center_;
  };
  // Writes the form of a slot. Precondition: has_forms().
  void put_form(uint32_t slot, const GridForm& form) {
    LOCUS_DCHECK(has_forms());
    LOCUS_DCHECK_LT(slot, count_);
    forms_[slot] = form;
  }

  // Copies `count` values of `from`, which has the same brick, to the slots from `to` on: all members except those
  // that Places::put_entry() writes.
  void copy_values(const GridBlock& from, uint32_t begin, uint32_t to, uint32_t count);

  // Checks the cell offsets and the padding of the float columns. Precondition: the block is a sorted block, not a log,
  // and all its slots have been written. O(cells).
  void check_invariants() const;

  size_t bytes() const { return sizeof(GridBlock) + bytes_; }

 private:
  uint32_t count_;
  uint32_t stride_;
  float* floats_ = nullptr;
  uint32_t* handles_ = nullptr;
  GridEntry* entries_ = nullptr;
  GridForm* forms_ = nullptr;
  size_t bytes_ = 0;
  std::unique_ptr<std::byte[]> memory_;
  std::array<uint32_t, kBrickCells + 1> offsets_{};
};

}  // namespace internal
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_HASH_GRID_GRID_BLOCK_H_
