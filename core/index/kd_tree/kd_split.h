// Planes that divide the values of a kd tree's node: the options of a tree, and the choice of a plane on one axis.
// Plain data and pure functions; any thread.
#ifndef LOCUS_CORE_INDEX_KD_TREE_KD_SPLIT_H_
#define LOCUS_CORE_INDEX_KD_TREE_KD_SPLIT_H_

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "absl/types/span.h"
#include "core/base/limits.h"
#include "core/geometry/aabb.h"
#include "core/index/cut_values.h"
#include "core/index/plane_nodes.h"

namespace locus {

// Axis on which a node is divided. If no plane on this axis separates values, the other axes are tried in turn.
enum class KdAxis : uint8_t {
  kByTurns,  // x, y, z, x, ... from level to level (Bentley 1975)
  kWidest,   // the axis on which the values of the node extend most
};

// Position of the dividing plane on its axis.
enum class KdSplit : uint8_t {
  kMiddle,  // middle of the box around the values; on dense clusters in a wide world the tree becomes deep
  kMean,    // mean of the positions of the values
  kMedian,  // median of the positions, which balances the tree (Bentley 1975)
  kSah,     // least cost by the surface area heuristic among evenly spaced planes; the fastest queries
};

struct KdTreeOptions {
  KdAxis axis = KdAxis::kWidest;
  KdSplit split = KdSplit::kSah;
  CutValues cut = CutValues::kInLeaves;
  uint32_t leaf_size = 8;                    // nodes with at most so many values are not divided; at least 1
  uint32_t max_depth = limits::kMaxKdDepth;  // max levels below the root, at most limits::kMaxKdDepth
};

namespace internal {

inline constexpr int kKdBins = 32;

// Returns the median of the positions; null if all are equal. Of two equal halves, the upper one is above the plane.
template <class S>
std::optional<S> kd_median(absl::Span<const PlacedBounds<S>> values, int axis) {
  std::vector<S> positions;
  positions.reserve(values.size());
  for (const PlacedBounds<S>& value : values) positions.push_back(value.position[axis]);
  const S highest = *std::max_element(positions.begin(), positions.end());
  const auto middle = positions.begin() + static_cast<ptrdiff_t>((positions.size() - 1) / 2);
  std::nth_element(positions.begin(), middle, positions.end());
  if (*middle < highest) return *middle;
  // More than half of the positions are equal to the highest one: the plane is at the highest of the other ones.
  const auto others = std::remove(positions.begin(), positions.end(), highest);
  if (others == positions.begin()) return std::nullopt;
  return *std::max_element(positions.begin(), others);
}

// Returns the plane with the least expected cost of a random ray that hits `box`; null if no plane costs less than an
// undivided node. Only evenly spaced planes are compared (Popov et al., Experiences with Streaming Construction of SAH
// KD-Trees, 2006), so that the cost is linear in the number of values.
template <class S>
std::optional<S> kd_sah(absl::Span<const PlacedBounds<S>> values, int axis, const Aabb<S>& box, CutValues cut) {
  const S low = box.min[axis], step = (box.max[axis] - low) / kKdBins;
  const auto bin = [&](S x) { return static_cast<int>(std::clamp((x - low) / step, S{0}, S{kKdBins - 1})); };
  size_t begins[kKdBins] = {}, ends[kKdBins] = {};
  for (const PlacedBounds<S>& value : values) {
    ++begins[bin(value.bounds.min[axis])];
    ++ends[bin(value.bounds.max[axis])];
  }
  const S whole_area = half_area(box);
  const auto measure = [&](const Aabb<S>& part) {  // share of the rays through `box` that hit `part`
    if (whole_area > 0) return double{half_area(part)} / double{whole_area};
    return double{part.extent()[axis]} / double{box.extent()[axis]};
  };
  const size_t count = values.size();
  size_t below = 0, above = count;                // values wholly on one side of the plane
  double least = static_cast<double>(count) - 1;  // opening a node costs as much as one test
  std::optional<S> result;
  for (int i = 1; i < kKdBins; ++i) {
    below += ends[i - 1];
    above -= begins[i - 1];
    Aabb<S> lower = box, upper = box;
    lower.max[axis] = upper.min[axis] = low + step * static_cast<S>(i);
    const bool in_leaves = cut == CutValues::kInLeaves;
    const double cost = measure(lower) * static_cast<double>(in_leaves ? count - above : below) +
                        measure(upper) * static_cast<double>(in_leaves ? count - below : above) +
                        static_cast<double>(in_leaves ? 0 : count - below - above);
    if (!(cost < least)) continue;
    least = cost;
    result = lower.max[axis];
  }
  return result;
}

}  // namespace internal

// Returns a plane on `axis` that divides `values`, at least one, by the rule `split`; null if the rule finds none.
// `box` is the box around their bounds. The plane need not separate any values, and it may lie outside `box`. Source of
// kSah: MacDonald and Booth, Heuristics for Ray Tracing Using Space Subdivision, 1990.
template <class S>
std::optional<S> kd_plane(KdSplit split, absl::Span<const PlacedBounds<S>> values, int axis, const Aabb<S>& box,
                          CutValues cut) {
  if (!(box.min[axis] < box.max[axis])) return std::nullopt;
  switch (split) {
    case KdSplit::kMiddle:
      return box.min[axis] / 2 + box.max[axis] / 2;
    case KdSplit::kMean: {
      double sum = 0;
      for (const PlacedBounds<S>& value : values) sum += double{value.position[axis]};
      return static_cast<S>(sum / static_cast<double>(values.size()));
    }
    case KdSplit::kMedian:
      return internal::kd_median(values, axis);
    case KdSplit::kSah:
      return internal::kd_sah(values, axis, box, cut);
  }
  return std::nullopt;
}

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_KD_TREE_KD_SPLIT_H_
