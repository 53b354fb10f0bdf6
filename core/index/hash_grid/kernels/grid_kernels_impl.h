// The culling loops of the hash grid, written once by vectors of eight floats. To be included by one source for each
// instruction set; everything has internal linkage.
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

inline Floats all(float value) { return Floats{} + value; }

// One bit a lane.
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

// The bits of values `slot` to slot + 7 that are gone.
inline uint32_t gone_bits(const uint64_t* gone, uint32_t slot) {
  uint16_t bits;
  std::memcpy(&bits, reinterpret_cast<const char*>(gone) + slot / 8, sizeof(bits));
  return (uint32_t{bits} >> (slot % 8)) & 0xFF;
}

#ifdef __AVX2__
// For each set of lanes, their numbers in order, a byte each.
struct LanesOfSets {
  constexpr LanesOfSets() {
    for (uint32_t set = 0; set < 256; ++set) {
      uint32_t next = 0;
      for (uint64_t lane = 0; lane < kLanes; ++lane)
        if ((set >> lane & 1) != 0) lanes[set] |= lane << (8 * next++);
    }
  }
  uint64_t lanes[256] = {};
};
constexpr LanesOfSets kLanesOfSets;
#endif

// Writes the slots of the lanes of `kept`, one after the other, and whatever behind them.
inline void write_slots(uint32_t kept, uint32_t slot, uint32_t* slots) {
#ifdef __AVX2__
  const __m256i lanes = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(static_cast<int64_t>(kLanesOfSets.lanes[kept])));
  const __m256i places = _mm256_add_epi32(lanes, _mm256_set1_epi32(static_cast<int32_t>(slot)));
  std::memcpy(slots, &places, sizeof(places));
#else
  for (; kept != 0; kept &= kept - 1) *slots++ = slot + static_cast<uint32_t>(__builtin_ctz(kept));
#endif
}

// The same, and their keys.
inline void write_lanes(uint32_t kept, uint32_t slot, Floats key, uint32_t* slots, float* keys) {
#ifdef __AVX2__
  const __m256i lanes = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(static_cast<int64_t>(kLanesOfSets.lanes[kept])));
  const __m256 first = _mm256_permutevar8x32_ps(reinterpret_cast<__m256>(key), lanes);
  std::memcpy(keys, &first, sizeof(first));
  const __m256i places = _mm256_add_epi32(lanes, _mm256_set1_epi32(static_cast<int32_t>(slot)));
  std::memcpy(slots, &places, sizeof(places));
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

// The vectors of all rows, one after the other: few loops of unknown length are more than one.
struct RowVectors {
  static constexpr uint32_t kUsual = 4;  // of a row
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

// Writes the slots of all values of the rows that keep(slot) has a bit for.
template <class Keep>
inline uint32_t collect(const GridRows& rows, uint32_t* slots, const Keep& keep) {
  uint32_t count = 0;
  for (uint32_t row = 0; row < rows.count; ++row) {
    const uint32_t end = rows.end[row];
    for (uint32_t slot = rows.begin[row]; slot < end; slot += kLanes) {
      uint32_t kept = keep(slot);
      if (end - slot < kLanes) kept &= (1u << (end - slot)) - 1;
      if (rows.gone != nullptr) kept &= ~gone_bits(rows.gone, slot);
      write_slots(kept, slot, slots + count);
      count += static_cast<uint32_t>(__builtin_popcount(kept));
    }
  }
  return count;
}

uint32_t cull_box(const GridRows& rows, const GridBox& box, uint32_t* slots) {
  const Floats low_x = all(box.low[0]), low_y = all(box.low[1]), low_z = all(box.low[2]);
  const Floats high_x = all(box.high[0]), high_y = all(box.high[1]), high_z = all(box.high[2]);
  return collect(rows, slots, [&](uint32_t slot) {
    const Floats x = load(rows.x + slot), y = load(rows.y + slot), z = load(rows.z + slot);
    const Floats reach = load(rows.reach + slot);
    const Lanes in_x = (x + reach >= low_x) & (x - reach <= high_x);
    const Lanes in_y = (y + reach >= low_y) & (y - reach <= high_y);
    const Lanes in_z = (z + reach >= low_z) & (z - reach <= high_z);
    return bits_of(in_x & in_y & in_z);
  });
}

uint32_t cull_ball(const GridRows& rows, const GridBall& ball, uint32_t* slots) {
  const Floats center_x = all(ball.center[0]), center_y = all(ball.center[1]), center_z = all(ball.center[2]);
  const Floats radius = all(ball.radius);
  return collect(rows, slots, [&](uint32_t slot) {
    const Floats x = load(rows.x + slot) - center_x, y = load(rows.y + slot) - center_y;
    const Floats z = load(rows.z + slot) - center_z;
    const Floats reach = load(rows.reach + slot) + radius;
    return bits_of(x * x + y * y + z * z <= reach * reach);
  });
}

uint32_t cull_line(const GridRows& rows, const GridLine& line, uint32_t* slots) {
  const Floats point_x = all(line.point[0]), point_y = all(line.point[1]), point_z = all(line.point[2]);
  const Floats toward_x = all(line.direction[0]), toward_y = all(line.direction[1]), toward_z = all(line.direction[2]);
  const Floats margin = all(line.margin), from = all(line.from), to = all(line.to);
  return collect(rows, slots, [&](uint32_t slot) {
    const Floats x = load(rows.x + slot) - point_x, y = load(rows.y + slot) - point_y;
    const Floats z = load(rows.z + slot) - point_z;
    const Floats along = x * toward_x + y * toward_y + z * toward_z;
    const Floats off_x = x - along * toward_x, off_y = y - along * toward_y, off_z = z - along * toward_z;
    const Floats reach = load(rows.reach + slot) * kDiagonal + margin;
    const Lanes near = off_x * off_x + off_y * off_y + off_z * off_z <= reach * reach;
    return bits_of(near & (along + reach >= from) & (along - reach <= to));
  });
}

// How far beyond `reach` from zero.
inline Floats gap_of(Floats along, Floats reach) {
  const Floats away = along < 0 ? -along : along;
  const Floats gap = away - reach;
  return gap > 0 ? gap : Floats{};
}

uint32_t collect_near(const GridRows& rows, const GridNear& near, uint32_t* slots, float* keys) {
  const Floats point_x = all(near.point[0]), point_y = all(near.point[1]), point_z = all(near.point[2]);
  const Floats margin = all(near.margin), above = all(near.above), upto = all(near.upto);
  const RowVectors vectors(rows);
  uint32_t count = 0;
  for (uint32_t i = 0; i < vectors.count; ++i) {
    const uint32_t slot = vectors.slot[i];
    const Floats reach = load(rows.reach + slot) + margin;
    const Floats x = gap_of(load(rows.x + slot) - point_x, reach);
    const Floats y = gap_of(load(rows.y + slot) - point_y, reach);
    const Floats z = gap_of(load(rows.z + slot) - point_z, reach);
    const Floats key = x * x + y * y + z * z;
    uint32_t kept = bits_of((key > above) & (key <= upto)) & vectors.lanes[i];
    if (rows.gone != nullptr) kept &= ~gone_bits(rows.gone, slot);
    write_lanes(kept, slot, key, slots + count, keys + count);
    count += static_cast<uint32_t>(__builtin_popcount(kept));
  }
  return count;
}

void sort_few(int32_t* numbers, uint32_t count) {
  if (count == 0) return;
  int32_t given[kMaxSorted + kLanes];
  std::memcpy(given, numbers, count * sizeof(int32_t));
  for (uint32_t i = 0; i < kLanes; ++i) given[count + i] = INT32_MAX;
  for (uint32_t i = 0; i < count; ++i) {
    const Lanes number = Lanes{} + given[i];
    uint32_t place = 0;  // how many are below
    for (uint32_t j = 0; j < count; j += kLanes) {
      Lanes others;
      std::memcpy(&others, given + j, sizeof(others));
      place += static_cast<uint32_t>(__builtin_popcount(bits_of(others < number)));
    }
    numbers[place] = given[i];
  }
}

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_HASH_GRID_KERNELS_GRID_KERNELS_IMPL_H_
