// Implementation of the hash grid's kernels, written once with vectors of eight floats. Included by one source file per
// instruction set; all functions have internal linkage, so that the linker does not merge functions of different
// instruction sets.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_KERNELS_GRID_KERNELS_IMPL_H_
#define LOCUS_CORE_INDEX_HASH_GRID_KERNELS_GRID_KERNELS_IMPL_H_

#ifdef __SSE2__
#include <immintrin.h>
#endif

#include <cstring>

#include "core/index/hash_grid/kernels/grid_kernels.h"

namespace locus {
namespace {

constexpr uint32_t kLanes = 8;

typedef float Floats __attribute__((vector_size(32)));
typedef int32_t Lanes __attribute__((vector_size(32)));

inline Floats load(const float* from) {
  Floats values;
  std::memcpy(&values, from, sizeof(values));
  return values;
}

inline Floats splat(float value) { return Floats{} + value; }

// Returns a mask with one bit per lane.
inline uint32_t bits_of(Lanes lanes) {
#if defined(__AVX2__)
  return static_cast<uint32_t>(_mm256_movemask_ps(reinterpret_cast<__m256>(lanes)));
#elif defined(__SSE2__)
  __m128 halves[2];
  std::memcpy(halves, &lanes, sizeof(halves));
  return static_cast<uint32_t>(_mm_movemask_ps(halves[0]) | _mm_movemask_ps(halves[1]) << 4);
#else
  uint32_t bits = 0;
  for (uint32_t lane = 0; lane < kLanes; ++lane) bits |= (lanes[lane] != 0 ? 1u : 0u) << lane;
  return bits;
#endif
}

// Returns a mask with one bit for each of the eight values from `slot` on. A bit is set if its value is dead.
inline uint32_t dead_bits(const uint64_t* dead, uint32_t slot) {
  uint16_t bits;
  std::memcpy(&bits, reinterpret_cast<const char*>(dead) + slot / 8, sizeof(bits));
  return (uint32_t{bits} >> (slot % 8)) & 0xFF;
}

#ifdef __AVX2__
// Table with one entry for each mask of lanes. An entry has the indices of the lanes in the mask, ascending, in one
// byte each.
struct LanesOfMasks {
  constexpr LanesOfMasks() {
    for (uint32_t mask = 0; mask < 256; ++mask) {
      uint32_t next = 0;
      for (uint64_t lane = 0; lane < kLanes; ++lane)
        if ((mask >> lane & 1) != 0) lanes[mask] |= lane << (8 * next++);
    }
  }
  uint64_t lanes[256] = {};
};
constexpr LanesOfMasks kLanesOfMasks;
#endif

// Writes the slots of the lanes in the mask `kept`, one after the other; lane 0 is slot `slot`. With kMarks, marks the
// lanes that are set in `inside`. May overwrite the first eight elements of `slots`, even if the mask has fewer lanes.
template <Marks kMarks>
inline void write_slots(uint32_t kept, uint32_t slot, Lanes inside, uint32_t* slots) {
#ifdef __AVX2__
  const __m256i lanes = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(static_cast<int64_t>(kLanesOfMasks.lanes[kept])));
  __m256i found = _mm256_add_epi32(lanes, _mm256_set1_epi32(static_cast<int32_t>(slot)));
  if constexpr (kMarks == Marks::kInside) {
    const __m256i marks = _mm256_slli_epi32(reinterpret_cast<__m256i>(inside), 31);
    found = _mm256_or_si256(found, _mm256_permutevar8x32_epi32(marks, lanes));
  }
  std::memcpy(slots, &found, sizeof(found));
#else
  const uint32_t marks = kMarks == Marks::kInside ? bits_of(inside) : 0;
  for (; kept != 0; kept &= kept - 1) {
    const auto lane = static_cast<uint32_t>(__builtin_ctz(kept));
    *slots++ = (slot + lane) | marks >> lane << 31;
  }
#endif
}

// Writes the slots and the keys of the lanes in the mask `kept`, in the same way as write_slots().
inline void write_lanes(uint32_t kept, uint32_t slot, Floats key, uint32_t* slots, float* keys) {
#ifdef __AVX2__
  const __m256i lanes = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(static_cast<int64_t>(kLanesOfMasks.lanes[kept])));
  const __m256 first = _mm256_permutevar8x32_ps(reinterpret_cast<__m256>(key), lanes);
  std::memcpy(keys, &first, sizeof(first));
  const __m256i found = _mm256_add_epi32(lanes, _mm256_set1_epi32(static_cast<int32_t>(slot)));
  std::memcpy(slots, &found, sizeof(found));
#else
  float all_keys[kLanes];
  std::memcpy(all_keys, &key, sizeof(all_keys));
  for (; kept != 0; kept &= kept - 1) {
    const auto lane = static_cast<uint32_t>(__builtin_ctz(kept));
    *keys++ = all_keys[lane];
    *slots++ = slot + lane;
  }
#endif
}

// List of the vectors of eight values that cover all rows. An entry has the vector's first slot and a mask of the lanes
// that belong to the row. One loop over this list is faster than a loop of unknown length for each row.
struct RowVectors {
  static constexpr uint32_t kUsual = 4;  // number of vectors that every row writes, in a loop of fixed length
  static constexpr uint32_t kMax = GridRows::kMaxValues / kLanes + GridRows::kMax + kUsual;

  explicit RowVectors(const GridRows& rows) {
    for (uint32_t row = 0; row < rows.count; ++row) {
      const uint32_t begin = rows.begin[row], values = rows.end[row] - begin;
      const uint32_t vectors = (values + kLanes - 1) / kLanes;
      for (uint32_t i = 0; i < kUsual; ++i) slot[count + i] = begin + i * kLanes;
      for (uint32_t i = kUsual; i < vectors; ++i) slot[count + i] = begin + i * kLanes;
      for (uint32_t i = 0; i < kUsual; ++i) lanes[count + i] = 0xFF;
      for (uint32_t i = kUsual; i < vectors; ++i) lanes[count + i] = 0xFF;
      count += vectors;
      if (vectors != 0) lanes[count - 1] = 0xFFu >> (vectors * kLanes - values);
    }
  }

  uint32_t count = 0;
  uint32_t slot[kMax];
  uint32_t lanes[kMax];
};

// Writes the slots of those values that are in the rows, are live, and are accepted by keep(). keep(slot, inside)
// returns a mask with one bit for each of the eight values from `slot` on and, with kMarks, sets the lanes of `inside`
// that write_slots() marks. Returns the number of written slots.
template <Marks kMarks, class Keep>
inline uint32_t collect(const GridRows& rows, uint32_t* slots, const Keep& keep) {
  uint32_t count = 0;
  for (uint32_t row = 0; row < rows.count; ++row) {
    const uint32_t end = rows.end[row];
    for (uint32_t slot = rows.begin[row]; slot < end; slot += kLanes) {
      Lanes inside{};
      uint32_t kept = keep(slot, inside);
      if (end - slot < kLanes) kept &= (1u << (end - slot)) - 1;
      if (rows.dead != nullptr) kept &= ~dead_bits(rows.dead, slot);
      write_slots<kMarks>(kept, slot, inside, slots + count);
      count += static_cast<uint32_t>(__builtin_popcount(kept));
    }
  }
  return count;
}

template <Marks kMarks>
uint32_t cull_box(const GridRows& rows, const GridBox& box, uint32_t* slots) {
  const Floats low_x = splat(box.low[0]), low_y = splat(box.low[1]), low_z = splat(box.low[2]);
  const Floats high_x = splat(box.high[0]), high_y = splat(box.high[1]), high_z = splat(box.high[2]);
  [[maybe_unused]] const Floats inner_low_x = splat(box.inner_low[0]), inner_low_y = splat(box.inner_low[1]),
                                inner_low_z = splat(box.inner_low[2]);
  [[maybe_unused]] const Floats inner_high_x = splat(box.inner_high[0]), inner_high_y = splat(box.inner_high[1]),
                                inner_high_z = splat(box.inner_high[2]);
  return collect<kMarks>(rows, slots, [&](uint32_t slot, [[maybe_unused]] Lanes& inside) {
    const Floats x = load(rows.x + slot), y = load(rows.y + slot), z = load(rows.z + slot);
    if constexpr (kMarks == Marks::kInside)
      inside = (x > inner_low_x) & (x < inner_high_x) & (y > inner_low_y) & (y < inner_high_y) & (z > inner_low_z) &
               (z < inner_high_z);
    const Floats extent = load(rows.extent + slot);
    const Lanes in_x = (x + extent >= low_x) & (x - extent <= high_x);
    const Lanes in_y = (y + extent >= low_y) & (y - extent <= high_y);
    const Lanes in_z = (z + extent >= low_z) & (z - extent <= high_z);
    return bits_of(in_x & in_y & in_z);
  });
}

template <Marks kMarks>
uint32_t cull_ball(const GridRows& rows, const GridBall& ball, uint32_t* slots) {
  const Floats center_x = splat(ball.center[0]), center_y = splat(ball.center[1]), center_z = splat(ball.center[2]);
  const Floats radius = splat(ball.radius);
  [[maybe_unused]] const Floats inner = splat(ball.inner_radius * ball.inner_radius);
  return collect<kMarks>(rows, slots, [&](uint32_t slot, [[maybe_unused]] Lanes& inside) {
    const Floats x = load(rows.x + slot) - center_x, y = load(rows.y + slot) - center_y;
    const Floats z = load(rows.z + slot) - center_z;
    const Floats extent = load(rows.extent + slot) + radius;
    const Floats squared = x * x + y * y + z * z;
    if constexpr (kMarks == Marks::kInside) inside = squared < inner;
    return bits_of(squared <= extent * extent);
  });
}

uint32_t cull_line(const GridRows& rows, const GridLine& line, uint32_t* slots) {
  const Floats point_x = splat(line.point[0]), point_y = splat(line.point[1]), point_z = splat(line.point[2]);
  const Floats toward_x = splat(line.direction[0]), toward_y = splat(line.direction[1]),
               toward_z = splat(line.direction[2]);
  const Floats radius = splat(line.radius), from = splat(line.from), to = splat(line.to);
  return collect<Marks::kNone>(rows, slots, [&](uint32_t slot, Lanes&) {
    const Floats x = load(rows.x + slot) - point_x, y = load(rows.y + slot) - point_y;
    const Floats z = load(rows.z + slot) - point_z;
    const Floats along = x * toward_x + y * toward_y + z * toward_z;
    const Floats off_x = x - along * toward_x, off_y = y - along * toward_y, off_z = z - along * toward_z;
    const Floats extent = load(rows.extent + slot) * kDiagonal + radius;
    const Lanes near = off_x * off_x + off_y * off_y + off_z * off_z <= extent * extent;
    return bits_of(near & (along + extent >= from) & (along - extent <= to));
  });
}

// Returns the distance of `along` from the interval [-extent, extent].
inline Floats gap_of(Floats along, Floats extent) {
  const Floats away = along < 0 ? -along : along;
  const Floats gap = away - extent;
  return gap > 0 ? gap : Floats{};
}

uint32_t collect_near(const GridRows& rows, const GridNear& near, uint32_t* slots, float* keys) {
  const Floats point_x = splat(near.point[0]), point_y = splat(near.point[1]), point_z = splat(near.point[2]);
  const Floats epsilon = splat(near.epsilon), above = splat(near.above), up_to = splat(near.up_to);
  const RowVectors vectors(rows);
  uint32_t count = 0;
  for (uint32_t i = 0; i < vectors.count; ++i) {
    const uint32_t slot = vectors.slot[i];
    const Floats extent = load(rows.extent + slot) + epsilon;
    const Floats x = gap_of(load(rows.x + slot) - point_x, extent);
    const Floats y = gap_of(load(rows.y + slot) - point_y, extent);
    const Floats z = gap_of(load(rows.z + slot) - point_z, extent);
    const Floats key = x * x + y * y + z * z;
    uint32_t kept = bits_of((key > above) & (key <= up_to)) & vectors.lanes[i];
    if (rows.dead != nullptr) kept &= ~dead_bits(rows.dead, slot);
    write_lanes(kept, slot, key, slots + count, keys + count);
    count += static_cast<uint32_t>(__builtin_popcount(kept));
  }
  return count;
}

void sort_few(int32_t* values, uint32_t count) {
  if (count == 0) return;
  int32_t given[kMaxSorted + kLanes];
  std::memcpy(given, values, count * sizeof(int32_t));
  for (uint32_t i = 0; i < kLanes; ++i) given[count + i] = INT32_MAX;
  for (uint32_t i = 0; i < count; ++i) {
    const Lanes value = Lanes{} + given[i];
    uint32_t rank = 0;  // number of smaller values
    for (uint32_t j = 0; j < count; j += kLanes) {
      Lanes others;
      std::memcpy(&others, given + j, sizeof(others));
      rank += static_cast<uint32_t>(__builtin_popcount(bits_of(others < value)));
    }
    values[rank] = given[i];
  }
}

// Returns the kernels of the instruction set for which this file is compiled.
constexpr GridKernels kernels_named(const char* name) {
  return {name,
          cull_box<Marks::kNone>,
          cull_line,
          cull_ball<Marks::kNone>,
          cull_box<Marks::kInside>,
          cull_ball<Marks::kInside>,
          collect_near,
          sort_few};
}

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_HASH_GRID_KERNELS_GRID_KERNELS_IMPL_H_
