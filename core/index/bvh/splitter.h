// Splits ranges of boxes in two: by the binned surface area heuristic, few boxes by every cut of their sorted centres,
// and by halves where areas tell nothing. What a part costs is its area times the blocks that its boxes fill at best
// and a little for each box. Internal to this folder. Pure functions. Source: Wald, On fast Construction of SAH-based
// Bounding Volume Hierarchies, 2007.
#ifndef LOCUS_CORE_INDEX_BVH_SPLITTER_H_
#define LOCUS_CORE_INDEX_BVH_SPLITTER_H_

#include <array>
#include <bit>
#include <cstdint>

#include "core/base/limits.h"
#include "core/index/bvh/box_reference.h"
#include "core/index/bvh/bvh_build.h"

namespace locus {

constexpr uint32_t blocks_for(uint32_t count) { return (count + kBvhLeafSize - 1) / kBvhLeafSize; }

// Levels that halving needs below a range until its parts fit leaves.
constexpr uint32_t balanced_levels(uint32_t count) {
  return static_cast<uint32_t>(std::bit_width(blocks_for(count) - 1));
}

static_assert(balanced_levels(8) == 0 && balanced_levels(9) == 1 && balanced_levels(17) == 2);
static_assert(balanced_levels(limits::kMaxBvhValues) < limits::kMaxBvhDepth,
              "halving alone stays within the depth limit");

// Bounds of references, and of their centres.
template <class S>
struct Extent {
  QuadBox<S> bounds = QuadBox<S>::empty();
  QuadBox<S> centers = QuadBox<S>::empty();
};

template <class S>
Extent<S> extent_of(BoxReferences<S> references);

// Two parts of a range of references, each with its extent.
template <class S>
struct Halves {
  uint32_t left_count = 0;
  std::array<Extent<S>, 2> parts;
};

template <class S>
class Splitter {
 public:
  explicit Splitter(const BvhOptions& options) : options_(options) {}

  // Reorders `references`, more than a leaf of them; both parts hold some. By halves too where another cut would leave
  // too few of the `levels` below to halve the larger part. Means nothing once the build is cancelled.
  Halves<S> split(BoxReferences<S> references, const Extent<S>& extent, uint32_t levels) const;

 private:
  const BvhOptions& options_;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_SPLITTER_H_
