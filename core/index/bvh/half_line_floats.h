// Half line from a point, parallel to an axis of the mesh, in floats that can be compared with the float coordinates of
// a tree. The comparisons are exact, although the point is in double: see below. Plain data. This header includes no
// other header of locus, because the kernels of every instruction set include it.
#ifndef LOCUS_CORE_INDEX_BVH_HALF_LINE_FLOATS_H_
#define LOCUS_CORE_INDEX_BVH_HALF_LINE_FLOATS_H_

namespace locus {

// For a coordinate p in double, let `low` be the greatest float that is at most p, and `high` the least float that is
// at least p. Then for every float x: x <= p if and only if x <= low, and x >= p if and only if x >= high.
struct HalfLineFloats {
  int axis;   // axis to which the half line is parallel: 0, 1 or 2
  float way;  // 1, or -1 if the half line runs towards lower coordinates
  // Float neighbours of p * way, where p is the point's coordinate on `axis`: along_low <= p * way <= along_high. A
  // coordinate x on this axis is behind the point if x * way < along_high, beyond the point if x * way > along_low,
  // and beyond the end of the search if along_end < x * way.
  float along_low, along_high;
  float along_end;  // coordinate on `axis` where the search ends, multiplied by `way`; infinite for an endless search
  // Float neighbours of the point's coordinates on the axes (axis + 1) % 3 and (axis + 2) % 3: low <= coordinate <=
  // high.
  float low[2], high[2];
  float rounded[2];  // the point's coordinates on these two axes, rounded to the nearest float
  float pad;         // upper bound of the difference between such a coordinate and its element of `rounded`
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_HALF_LINE_FLOATS_H_
