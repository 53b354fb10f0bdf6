// Kernels that cull the values of the hash grid in float, eight at a time. The kernels are compiled once per
// instruction set; GridKernels is the table of the kernels for one instruction set. All other types are plain data. The
// kernels only cull, and mark the values whose positions are surely inside a box or ball; their callers apply the exact
// predicates, in double. Any thread may call the kernels.
//
// A kernel never drops a value that satisfies the caller's original query, in spite of rounding. For this purpose,
// callers widen the query by kCullEpsilon times the magnitudes of the query's coordinates and the brick's coordinates.
// The widening covers the rounding of the columns to float (2^-24 of a coordinate), of the query to float (2^-24), and
// of the sums, products and fused products of the kernels (each 2^-24 of its result). For the same reason, callers
// narrow the box or ball inside which positions are marked by as much.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_KERNELS_GRID_KERNELS_H_
#define LOCUS_CORE_INDEX_HASH_GRID_KERNELS_GRID_KERNELS_H_

#include <cstdint>

namespace locus {

inline constexpr float kCullEpsilon = 0x1p-20f;
inline constexpr float kDiagonal =
    1.73206f;  // upper bound of sqrt(3): distance from a position to a corner of the bounds, in extents
inline constexpr uint32_t kMaxSorted = 64;
// Selects whether a search for a box or ball marks the values whose positions are surely inside.
enum class Marks : uint8_t { kNone, kInside };
// Mark of a slot that mark_box() or mark_ball() writes: the position of the value is surely inside the box or ball. A
// slot without the mark is outside, or so close to the border that float arithmetic cannot decide.
inline constexpr uint32_t kInsideMark = 1u << 31;

// Rows of one block. A row is a range of consecutive values.
struct GridRows {
  static constexpr uint32_t kMax = 16;         // max rows
  static constexpr uint32_t kMaxValues = 512;  // max values in all rows of one call

  const float* x;
  const float* y;
  const float* z;
  const float* extent;
  const uint64_t* dead;  // one bit per slot, set if the value is dead, then 64 bits of padding; null if none is dead
  uint32_t count;
  uint32_t begin[kMax];
  uint32_t end[kMax];
};

struct GridBox {
  float low[3], high[3];
  float inner_low[3] = {},
        inner_high[3] = {};  // for mark_box(): a position strictly between these corners is inside the box
};

struct GridLine {
  float point[3], direction[3];  // the direction has length 1
  float radius;                  // radius of the line; kDiagonal times a value's extent is added to it
  float from, to;                // part of the line, as signed distances from `point`
};

struct GridBall {
  float center[3];
  float radius;
  float inner_radius = 0;  // for mark_ball(): a position nearer to the centre than this is inside the ball; >= 0
};

// Shell around a point: the values with above < key <= up_to. The key of a value is the squared distance of its bounds
// from the point.
struct GridNear {
  float point[3];
  float epsilon;  // added to the extent of a value
  float above, up_to;
};

struct GridKernels {
  const char* name;
  // Write to `slots`, in increasing order within each row, the slots of the values that may satisfy the query, and
  // return their number. cull_box() and cull_line() keep every value whose bounds may intersect the box or line;
  // cull_ball() keeps every value that may share a point with the ball. `slots` has room for kMaxValues elements and
  // one vector of eight more.
  uint32_t (*cull_box)(const GridRows& rows, const GridBox& box, uint32_t* slots);
  uint32_t (*cull_line)(const GridRows& rows, const GridLine& line, uint32_t* slots);
  uint32_t (*cull_ball)(const GridRows& rows, const GridBall& ball, uint32_t* slots);
  // Keep the same values as cull_box() and cull_ball(), and add kInsideMark to the slots of those whose positions are
  // inside the inner box or ball.
  uint32_t (*mark_box)(const GridRows& rows, const GridBox& box, uint32_t* slots);
  uint32_t (*mark_ball)(const GridRows& rows, const GridBall& ball, uint32_t* slots);
  // Writes to `slots`, in increasing order within each row, the slots of the values in the shell, and writes the keys
  // of these values to `keys`. Returns the number of these values. A key never exceeds the exact squared distance. Both
  // arrays have room for kMaxValues elements and one vector of eight more.
  uint32_t (*collect_near)(const GridRows& rows, const GridNear& near, uint32_t* slots, float* keys);
  // Sorts at most kMaxSorted distinct integers in increasing order.
  void (*sort_few)(int32_t* values, uint32_t count);
};

const GridKernels& grid_kernels_portable();
const GridKernels& grid_kernels_avx2();

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_HASH_GRID_KERNELS_GRID_KERNELS_H_
