// Moves of a batch, and the sources (values that stay, move or arrive) from which the next version of a brick is built.
// For the single writer of a grid.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_BRICK_SOURCES_H_
#define LOCUS_CORE_INDEX_HASH_GRID_BRICK_SOURCES_H_

#include <algorithm>
#include <cstring>
#include <vector>

#include "absl/types/span.h"
#include "core/index/hash_grid/brick.h"

namespace locus {

// New pose of a value in the grid.
struct alignas(32) GridMove {
  static constexpr uint32_t kKeeps = ~0u;

  Vec3d position;
  uint32_t handle = 0;
  uint32_t rotation = kKeeps;  // index in GridMoves::rotations; kKeeps = unchanged
};

// Moves of a batch. Borrows all arrays.
struct GridMoves {
  absl::Span<const GridMove> moves;  // one move for each moved handle
  absl::Span<const Quaternion> rotations = {};
  // For each handle, the index in `moves` of its move. Optional; reduces the cost of a batch that contains only moves,
  // of at least half of all values. The entry of a handle without a move may be any number i, so a reader must compare
  // moves[i].handle with the handle.
  absl::Span<const uint32_t> by_handle = {};
};

namespace internal {

// Location of a value in the grid, used by the writer only.
struct GridSlot {
  static constexpr uint32_t kRecent = 1u << 31;  // bit of `slot`: set for Brick::recent, clear for Brick::sorted

  uint32_t brick = 0;
  uint32_t slot = 0;
};

// Source of one value of the next version of a brick: a slot of the present version or an arrival.
struct BrickSource {
  static constexpr uint32_t kArrival = 1u << 30;  // bit of `origin`: set for the index of an arrival
  static constexpr uint32_t kNoMove = ~0u;

  uint32_t origin;  // index of an arrival with bit kArrival set, or present slot, encoded as in GridSlot::slot
  uint32_t move;    // index in GridMoves::moves; kNoMove if the value is unchanged or arrives
  uint32_t cell;    // new cell; unused if the value is appended to the log
};

// Value of a sorted block that moves to another cell of the brick or leaves the brick.
struct CellChange {
  static constexpr uint32_t kLeaves = kBrickCells;

  uint32_t slot;
  uint16_t from;  // present cell
  uint16_t to;    // new cell, or kLeaves
};

// Moves of the values of a sorted block.
struct BlockMoves {
  absl::Span<const uint32_t> moves;           // for each slot, the index of its move, or BrickSource::kNoMove
  absl::Span<const CellChange> cell_changes;  // ascending by slot
};

// Lookup of moves by handle. Precondition: the batch has moves, and GridMoves::by_handle is given.
class MoveFinder {
 public:
  explicit MoveFinder(const GridMoves& moves) : moves_(moves.moves), index_by_handle_(moves.by_handle) {
    LOCUS_DCHECK(!moves_.empty());
    LOCUS_DCHECK(!index_by_handle_.empty());
  }

  // Returns the index of the move of `handle`. For a handle without a move, returns the index of an arbitrary move, so
  // the caller must compare the handle of that move with `handle`.
  uint32_t index_of(uint32_t handle) const {
    const uint32_t index = handle < index_by_handle_.size() ? index_by_handle_[handle] : 0;
    return index < moves_.size() ? index : 0;
  }
  const GridMove& operator[](uint32_t index) const { return moves_.data()[index]; }

 private:
  absl::Span<const GridMove> moves_;
  absl::Span<const uint32_t> index_by_handle_;
};

// Writes to `out` a source for each value that stays in the brick, even if the value moves within the brick. Reads the
// values in the first `count` slots of `block`, except slots for which is_dead(slot) returns true. Returns the end of
// the written sources. Calls leave(block, slot, move) for each value that moves out of the brick. Adds to `moved` the
// number of values that move, within the brick or out of the brick. `flag` is GridSlot::kRecent if the block is a log,
// else 0. `out` must have room for `count` sources.
template <class IsDead, class Leave>
BrickSource* gather_block(const BrickGeometry& geometry, const GridBlock& block, uint32_t count, uint32_t flag,
                          const MoveFinder& moves, BrickSource* out, size_t& moved, const IsDead& is_dead,
                          const Leave& leave) {
  constexpr uint32_t kGroup = 16;  // values whose moves are prefetched together
  uint32_t indices[kGroup];
  for (uint32_t begin = 0; begin < count; begin += kGroup) {
    const uint32_t end = std::min(count, begin + kGroup);
    for (uint32_t slot = begin; slot < end; ++slot) {
      indices[slot - begin] = moves.index_of(block.handle(slot));
      __builtin_prefetch(&moves[indices[slot - begin]]);
    }
    for (uint32_t slot = begin; slot < end; ++slot) {
      if (is_dead(slot)) continue;
      const uint32_t index = indices[slot - begin];
      const GridMove& move = moves[index];
      if (move.handle != block.handle(slot)) {
        const Vec3d position = block.entry(slot).position;
        *out++ = {slot | flag, BrickSource::kNoMove, static_cast<uint32_t>(geometry.cell_of(position))};
        continue;
      }
      ++moved;
      if (const int cell = geometry.cell_if_here(move.position); cell >= 0) {
        *out++ = {slot | flag, index, static_cast<uint32_t>(cell)};
      } else {
        leave(block, slot, move);
      }
    }
  }
  return out;
}

// Calls gather_block() for the sorted block and the log of a brick.
template <class Leave>
BrickSource* gather_brick(const Brick& brick, const MoveFinder& moves, BrickSource* out, size_t& moved,
                          const Leave& leave) {
  const BrickGeometry geometry = brick.geometry;  // a copy, so that the compiler knows that no store changes it
  const auto none_dead = [](uint32_t) { return false; };
  const auto is_dead = [&brick](uint32_t slot) { return brick.is_dead(slot); };
  const auto is_recent_dead = [&brick](uint32_t slot) { return brick.is_recent_dead(slot); };
  const GridBlock& sorted = *brick.sorted;
  out = brick.dead_count == 0 ? gather_block(geometry, sorted, sorted.count(), 0, moves, out, moved, none_dead, leave)
                              : gather_block(geometry, sorted, sorted.count(), 0, moves, out, moved, is_dead, leave);
  if (brick.recent_count == 0) return out;
  return gather_block(geometry, *brick.recent, brick.recent_count, GridSlot::kRecent, moves, out, moved, is_recent_dead,
                      leave);
}

// Writes the present cell of each slot of the sorted block to `cells`, and more cells than that: `cells` has room for
// kCellsPerStore more elements than the block has slots.
inline constexpr uint32_t kCellsPerStore = 32;
inline void write_cells(const GridBlock& sorted, uint8_t* cells) {
  for (size_t cell = 0; cell < kBrickCells; ++cell) {
    const uint32_t begin = sorted.offsets()[cell], end = sorted.offsets()[cell + 1];
    // Most cells have fewer values than one store writes; the next cells overwrite the rest.
    std::memset(cells + begin, static_cast<int>(cell), kCellsPerStore);
    for (uint32_t slot = begin + kCellsPerStore; slot < end; slot += kCellsPerStore)
      std::memset(cells + slot, static_cast<int>(cell), kCellsPerStore);
  }
}

// Finds the moves of the values of a brick that has no log and no dead values. Writes the index of the move of each
// slot to `out`, or BrickSource::kNoMove. Appends to `cell_changes` the values that move to another cell, and calls
// leave(block, slot, move) for those that move out of the brick. Returns the number of values that move. `cells` are
// the present cells of the slots, as from write_cells().
template <class Leave>
size_t find_moves(const Brick& brick, const uint8_t* cells, const MoveFinder& moves, uint32_t* out,
                  std::vector<CellChange>& cell_changes, const Leave& leave) {
  constexpr uint32_t kGroup = 16;                 // values whose moves are prefetched together
  const BrickGeometry geometry = brick.geometry;  // a copy, so that the compiler knows that no store changes it
  const GridBlock& block = *brick.sorted;
  const uint32_t* const handles = GridBlock::Values(block).handles;
  size_t moved = 0;
  for (uint32_t begin = 0; begin < block.count(); begin += kGroup) {
    const uint32_t end = std::min(block.count(), begin + kGroup);
    for (uint32_t slot = begin; slot < end; ++slot) {
      out[slot] = moves.index_of(handles[slot]);
      __builtin_prefetch(&moves[out[slot]]);
    }
    for (uint32_t slot = begin; slot < end; ++slot) {
      const GridMove& move = moves[out[slot]];
      if (move.handle != handles[slot]) {
        out[slot] = BrickSource::kNoMove;
        continue;
      }
      ++moved;
      const int cell = geometry.cell_if_here(move.position);
      if (cell == cells[slot]) continue;
      if (cell < 0) leave(block, slot, move);
      cell_changes.push_back({slot, cells[slot], static_cast<uint16_t>(cell < 0 ? CellChange::kLeaves : cell)});
    }
  }
  return moved;
}

}  // namespace internal
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_HASH_GRID_BRICK_SOURCES_H_
