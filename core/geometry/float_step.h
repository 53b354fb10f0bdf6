// Inline replacement of std::nextafter(): code that takes several such steps per ray is measurably slower with calls
// of the C library. Pure functions; any thread.
#ifndef LOCUS_CORE_GEOMETRY_FLOAT_STEP_H_
#define LOCUS_CORE_GEOMETRY_FLOAT_STEP_H_

#include <bit>
#include <cstdint>
#include <limits>

namespace locus {

// Returns std::nextafter(value, infinity), bit for bit. Returns a NaN if `value` is a NaN.
inline float next_above(float value) {
  if (!(value < std::numeric_limits<float>::infinity())) return value;
  if (value == 0) return std::numeric_limits<float>::denorm_min();
  const auto bits = std::bit_cast<uint32_t>(value);
  return std::bit_cast<float>(value > 0 ? bits + 1 : bits - 1);
}

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_FLOAT_STEP_H_
