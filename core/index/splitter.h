// Splits a range of boxes into two parts by the surface area heuristic. A large range is distributed to bins and split
// between two bins; a small range is sorted by centre and split at the best of all cuts. If the heuristic finds no cut,
// the range is halved at the median centre. The cost of a part is its surface area times (the minimum number of leaves
// for its boxes + a small term for each box). Internal to core/index. Pure functions. Source: Wald, On fast
// Construction of SAH-based Bounding Volume Hierarchies, 2007.
#ifndef LOCUS_CORE_INDEX_SPLITTER_H_
#define LOCUS_CORE_INDEX_SPLITTER_H_

#include <array>
#include <bit>
#include <cstdint>

#include "core/base/limits.h"
#include "core/index/box_reference.h"
#include "core/index/tree_build.h"

namespace locus {

// Returns the minimum number of leaves (blocks) for `count` values.
constexpr uint32_t blocks_for(uint32_t count) { return (count + kBvhLeafSize - 1) / kBvhLeafSize; }

// Returns the number of times a range must be halved until each part fits in a leaf.
constexpr uint32_t balanced_levels(uint32_t count) {
  return static_cast<uint32_t>(std::bit_width(blocks_for(count) - 1));
}

static_assert(balanced_levels(8) == 0 && balanced_levels(9) == 1 && balanced_levels(17) == 2);
static_assert(balanced_levels(limits::kMaxBvhValues) < limits::kMaxBvhDepth,
              "halving alone stays within the depth limit");

// Bounds of a range of references, and bounds of their centres.
template <class S>
struct Extent {
  QuadBox<S> bounds = QuadBox<S>::empty();
  QuadBox<S> centers = QuadBox<S>::empty();
};

// Returns the extent of `references`. O(n).
template <class S>
Extent<S> extent_of(BoxReferences<S> references);

// Result of a split: the length of the left part, and the extents of both parts.
template <class S>
struct Halves {
  uint32_t left_count = 0;
  std::array<Extent<S>, 2> parts;
};

// Splitter of ranges of references for one build. Borrows the options.
template <class S>
class Splitter {
 public:
  explicit Splitter(const BvhOptions& options) : options_(options) {}

  // Splits `references`, which must have more than kBvhLeafSize elements, and reorders them so that the left part
  // precedes the right part. Neither part is empty. `extent` is extent_of(references), and `levels` is the number of
  // tree levels available below the two parts. If the best cut leaves a part that cannot be halved into leaves within
  // `levels` levels, `references` are halved at the median centre instead. The result is undefined if the build was
  // cancelled.
  Halves<S> split(BoxReferences<S> references, const Extent<S>& extent, uint32_t levels) const;

 private:
  // Verifies the result of split() in debug builds, unless the build was cancelled. O(n).
  void check_halves(BoxReferences<S> references, const Extent<S>& extent, uint32_t levels,
                    const Halves<S>& halves) const;

  const BvhOptions& options_;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_SPLITTER_H_
