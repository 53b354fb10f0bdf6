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

// Writes the slots of all values of the rows that keep(slot) has a bit for.
template <class Keep>
inline uint32_t collect(const GridRows& rows, uint32_t* slots, const Keep& keep) {
  uint32_t* out = slots;
  for (uint32_t row = 0; row < rows.count; ++row) {
    const uint32_t end = rows.end[row];
    for (uint32_t slot = rows.begin[row]; slot < end; slot += kLanes) {
      uint32_t kept = keep(slot);
      if (end - slot < kLanes) kept &= (1u << (end - slot)) - 1;
      if (rows.gone != nullptr) kept &= ~gone_bits(rows.gone, slot);
      for (; kept != 0; kept &= kept - 1) *out++ = slot + static_cast<uint32_t>(__builtin_ctz(kept));
    }
  }
  return static_cast<uint32_t>(out - slots);
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
  const Floats margin = all(line.margin);
  return collect(rows, slots, [&](uint32_t slot) {
    const Floats x = load(rows.x + slot) - point_x, y = load(rows.y + slot) - point_y;
    const Floats z = load(rows.z + slot) - point_z;
    const Floats along = x * toward_x + y * toward_y + z * toward_z;
    const Floats off_x = x - along * toward_x, off_y = y - along * toward_y, off_z = z - along * toward_z;
    const Floats reach = load(rows.reach + slot) + margin;
    return bits_of(off_x * off_x + off_y * off_y + off_z * off_z <= reach * reach);
  });
}

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_HASH_GRID_KERNELS_GRID_KERNELS_IMPL_H_
