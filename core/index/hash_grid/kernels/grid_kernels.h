// What culls the values of the hash grid in float, eight at a time. Plain data and a table of functions, compiled once
// for each instruction set; everything that decides is done elsewhere, in double. Threads: any.
//
// The functions keep every value that the caller's numbers allow, whatever the rounding of their own few operations:
// callers widen their numbers by kCullSlack of the magnitudes they give. That covers, with room to spare, the rounding
// of the columns to float (2^-24 of a coordinate), of the query's numbers (2^-24), and of the sums, products and fused
// products below (each 2^-24 of its result).
#ifndef LOCUS_CORE_INDEX_HASH_GRID_KERNELS_GRID_KERNELS_H_
#define LOCUS_CORE_INDEX_HASH_GRID_KERNELS_GRID_KERNELS_H_

#include <cstdint>

namespace locus {

inline constexpr float kCullSlack = 0x1p-20f;
inline constexpr float kDiagonal = 1.73206f;  // the corners of a value's bounds, in reaches: the root of 3, and more
inline constexpr uint32_t kMaxSorted = 64;

// Some rows of consecutive values of one block.
struct GridRows {
  static constexpr uint32_t kMax = 16;         // rows
  static constexpr uint32_t kMaxValues = 512;  // of all rows of one call

  const float* x;
  const float* y;
  const float* z;
  const float* reach;
  const uint64_t* gone;  // one bit a value, and 64 more; null where none is gone
  uint32_t count;
  uint32_t begin[kMax];
  uint32_t end[kMax];
};

struct GridBox {
  float low[3], high[3];
};

struct GridLine {
  float point[3], direction[3];  // the direction has length 1
  float margin;                  // added to every reach times kDiagonal
  float from, to;                // the part that is asked for, by its distance from `point`
};

struct GridBall {
  float center[3];
  float radius;
};

// The values around a point whose key, the squared distance of their bounds, is above one number and up to another.
struct GridNear {
  float point[3];
  float margin;  // added to every reach
  float above, upto;
};

struct GridKernels {
  const char* name;
  // Each writes the slots, in order, of values that reach the box, the line or the ball, and returns how many. There is
  // room for kMaxValues and a vector.
  uint32_t (*cull_box)(const GridRows& rows, const GridBox& box, uint32_t* slots);
  uint32_t (*cull_line)(const GridRows& rows, const GridLine& line, uint32_t* slots);
  uint32_t (*cull_ball)(const GridRows& rows, const GridBall& ball, uint32_t* slots);
  // Likewise, and each one's key, which is none too large.
  uint32_t (*collect_near)(const GridRows& rows, const GridNear& near, uint32_t* slots, float* keys);
  // Sorts at most kMaxSorted numbers, of which no two are equal.
  void (*sort_few)(int32_t* numbers, uint32_t count);
};

const GridKernels& grid_kernels_portable();
const GridKernels& grid_kernels_avx2();

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_HASH_GRID_KERNELS_GRID_KERNELS_H_
