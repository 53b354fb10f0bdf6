// The values of one brick of the hash grid, in columns: what culls in float, relative to the brick's centre, eight at a
// time, and what decides in double, one entry a value. Immutable once shared, but for a log, which has room for values
// that its one writer adds behind those that readers know of; any thread.
//
// Invariants: values lie in the order of their cells, those of cell c at offsets[c] to offsets[c + 1], but not in logs,
// where they lie in the order they came; float columns
// are padded with zeros to whole vectors, and so many more that a vector may start at any value.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_GRID_BLOCK_H_
#define LOCUS_CORE_INDEX_HASH_GRID_GRID_BLOCK_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "core/base/ids.h"
#include "core/geometry/shape.h"

namespace locus {

// One value as the grid stores it, but for its form, its reach and its handle.
struct GridEntry {
  Vec3d position;
  Id id = kNoId;
  Group group = 0;
  Tag tag = 0;
  Layers layers = kDefaultLayers;
  ShapeKind kind = ShapeKind::kPoint;
};
static_assert(sizeof(GridEntry) == 56);

// What most values go without: as in Shape.
struct GridForm {
  Quaternion rotation;
  Vec3f size;
  float radius = 0;  // not of balls, whose radius is their reach

  friend constexpr bool operator==(const GridForm&, const GridForm&) = default;
};

// A value on its way into the grid. `handle` is the caller's number for it. `reach`: how far it extends from its
// position in any direction, whatever its rotation, but for the rounding of bounds; the exact radius of balls.
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

  // `count` values, to be put() once each: before the block is shared or, in a log, before their number is.
  GridBlock(uint32_t count, bool has_forms);

  uint32_t count() const { return count_; }
  bool has_forms() const { return forms_ != nullptr; }
  // Columns x, y, z relative to the centre, and reach.
  const float* column(int number) const { return floats_ + size_t{stride_} * static_cast<size_t>(number); }
  const GridEntry& entry(uint32_t slot) const { return entries_[slot]; }
  float reach(uint32_t slot) const { return column(3)[slot]; }
  GridForm form(uint32_t slot) const { return forms_ == nullptr ? GridForm() : forms_[slot]; }
  uint32_t handle(uint32_t slot) const { return handles_[slot]; }
  GridItem item(uint32_t slot) const { return {entry(slot), handle(slot), reach(slot), form(slot)}; }
  // Where the value of that handle is; count() if it is not here. O(count), a vector at a time.
  uint32_t find(uint32_t handle) const;
  // Of the first `count` values of a log the last one of that handle; `count` if there is none.
  uint32_t find_last(uint32_t handle, uint32_t count) const;
  // As find(), looking only at the few places around `slot`.
  uint32_t find_near(uint32_t handle, uint32_t slot) const;

  std::array<uint32_t, kBrickCells + 1>& offsets() { return offsets_; }
  const std::array<uint32_t, kBrickCells + 1>& offsets() const { return offsets_; }

  // Asks for the memory of a value that is to be read or put() soon: an entry lies in two lines more often than in one.
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
  [[gnu::always_inline]] void prefetch_place(uint32_t slot) const {
    for (int number = 0; number < 3; ++number) __builtin_prefetch(&column(number)[slot], 1);
    prefetch_value(slot);
  }

  // What a writer's loop keeps in registers: where values are read from,
  struct Values {
    explicit Values(const GridBlock& block)
        : entries(block.entries_), handles(block.handles_), reaches(block.column(3)) {}

    const GridEntry* entries;
    const uint32_t* handles;
    const float* reaches;
  };
  // and where they are put.
  class Places {
   public:
    explicit Places(const GridBlock& block, Vec3d center)
        : x_(block.floats_),
          y_(x_ + block.stride_),
          z_(y_ + block.stride_),
          reach_(z_ + block.stride_),
          handles_(block.handles_),
          entries_(block.entries_),
          center_(center) {}

    // `entry` at another position, perhaps.
    void put(uint32_t slot, const GridEntry& entry, Vec3d position, uint32_t handle, float reach) const {
      x_[slot] = static_cast<float>(position.x - center_.x);
      y_[slot] = static_cast<float>(position.y - center_.y);
      z_[slot] = static_cast<float>(position.z - center_.z);
      reach_[slot] = reach;
      handles_[slot] = handle;
      entries_[slot] = entry;
      entries_[slot].position = position;
    }

   private:
    float *x_, *y_, *z_, *reach_;
    uint32_t* handles_;
    GridEntry* entries_;
    Vec3d center_;
  };
  // Only where has_forms().
  void put_form(uint32_t slot, const GridForm& form) { forms_[slot] = form; }

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
