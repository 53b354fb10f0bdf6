#include "core/index/splitter.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/check.h"

namespace locus {
namespace {

using limits::kMaxBvhBins;

// Maximum number of references in a range that is sorted instead of binned.
constexpr size_t kMaxOrdered = 32;
// Number of references processed between two checks of the cancel flag.
constexpr size_t kReferencesBetweenChecks = 1u << 16;
// Cost of a reference relative to the cost of a block. This cost distinguishes cuts whose parts need equally many
// blocks: the cut that leaves fewer references in large boxes costs less. A much larger value would result in blocks
// with fewer references, which wastes memory.
constexpr double kReferenceCost = 1.0 / 128;

// Calls `each` for successive chunks of `references`. Returns false if the build was cancelled before the last chunk.
template <class S, class Each>
bool for_each_chunk(BoxReferences<S> references, const BvhOptions& options, Each each) {
  while (!references.empty()) {
    if (cancelled(options)) return false;
    each(references.subspan(0, kReferencesBetweenChecks));
    references.remove_prefix(std::min(references.size(), kReferencesBetweenChecks));
  }
  return true;
}

// Mapping of centres to bins along all axes at once. If all centres coincide along an axis, or if the scale from
// centres to bins overflows or underflows, all centres are in bin 0 of that axis.
template <class S>
class Binning {
 public:
  Binning(const QuadBox<S>& centers, uint32_t bins)
      : low_(centers.min), last_(Quad<S>::splat(static_cast<S>(bins - 1))) {
    std::array<S, 3> scale{};
    for (int axis = 0; axis < 3; ++axis) {
      const S wanted = static_cast<S>(bins) / (centers.max[axis] - centers.min[axis]);
      if (wanted > 0 && std::isfinite(wanted)) scale[static_cast<size_t>(axis)] = wanted;
    }
    scale_ = Quad<S>::of(scale[0], scale[1], scale[2], 0);
  }

  std::array<int32_t, 4> bins_of(const BoxReference<S>& reference) const {
    const Quad<S> position = (reference.center() - low_) * scale_;
    return minimum(maximum(position, Quad<S>::splat(0)), last_).to_int();
  }

 private:
  Quad<S> low_, last_, scale_;
};

// Bounds and number of the references in each bin, indexed by axis and bin.
template <class S>
struct Bins {
  std::array<std::array<QuadBox<S>, kMaxBvhBins>, 3> boxes;
  std::array<std::array<uint32_t, kMaxBvhBins>, 3> counts;
};

// Returns the cost of visiting a part with `count` references, relative to the part's surface area.
template <class S>
S cost_of(uint32_t count) {
  return static_cast<S>(blocks_for(count)) + static_cast<S>(kReferenceCost) * static_cast<S>(count);
}

// Cut of a range into two parts.
template <class S>
struct Split {
  int axis = -1;     // -1 if no cut was found
  uint32_t bin = 0;  // first bin of the right part
  S cost = std::numeric_limits<S>::infinity();
  // Difference of the numbers of references in the two parts. At equal cost the cut with the lower difference wins. Set
  // only by cuts of sorted references; 0 for cuts between bins.
  uint32_t imbalance = 0;
};

// Sweeps the bins of one axis from both sides. Replaces `best` by the cheapest cut between two bins if this cut costs
// less than `best`. `total` is the number of references in all bins.
template <class S>
void find_cheapest_cut(const Bins<S>& bins, size_t axis, uint32_t bin_count, uint32_t total, Split<S>& best) {
  std::array<S, kMaxBvhBins> right_cost;
  QuadBox<S> sum = QuadBox<S>::empty();
  uint32_t count = 0;
  for (size_t i = bin_count - 1; i > 0; --i) {
    sum.add(bins.boxes[axis][i]);
    count += bins.counts[axis][i];
    right_cost[i] = count == 0 ? 0 : half_area(sum) * cost_of<S>(count);
  }
  sum = QuadBox<S>::empty();
  count = 0;
  for (size_t i = 1; i < bin_count; ++i) {
    sum.add(bins.boxes[axis][i - 1]);
    count += bins.counts[axis][i - 1];
    if (count == 0 || count == total) continue;
    const S cost = half_area(sum) * cost_of<S>(count) + right_cost[i];
    if (cost < best.cost) best = {static_cast<int>(axis), static_cast<uint32_t>(i), cost, 0};
  }
}

// Orders of up to kMaxOrdered references by their centres, one order for each axis. References with equal centres keep
// their relative order.
template <class S>
class Orders {
 public:
  // Computes the rank of each reference on each axis, which is the number of references before it in sorted order. All
  // pairs of references are compared, on all axes together and without a branch.
  explicit Orders(BoxReferences<S> references) {
    LOCUS_DCHECK_LE(references.size(), kMaxOrdered);
    std::array<Quad<S>, kMaxOrdered> centers, ranks;
    for (size_t i = 0; i < references.size(); ++i) {
      const Quad<S> center = references[i].center();
      Quad<S> rank = Quad<S>::splat(0);
      for (size_t j = 0; j < i; ++j) {
        const Quad<S> not_after = less_or_equal(centers[j], center);
        rank = rank + not_after;
        ranks[j] = ranks[j] + (Quad<S>::splat(1) - not_after);
      }
      centers[i] = center;
      ranks[i] = rank;
    }
    for (size_t i = 0; i < references.size(); ++i) {
      const std::array<int32_t, 4> rank = ranks[i].to_int();
      for (size_t axis = 0; axis < 3; ++axis) order_[axis][static_cast<size_t>(rank[axis])] = static_cast<uint8_t>(i);
    }
  }

  size_t at(size_t axis, size_t rank) const { return order_[axis][rank]; }

  void apply(size_t axis, BoxReferences<S> references) const {
    std::array<BoxReference<S>, kMaxOrdered> ordered;
    for (size_t i = 0; i < references.size(); ++i) ordered[i] = references[at(axis, i)];
    std::copy_n(ordered.begin(), references.size(), references.begin());
  }

 private:
  std::array<std::array<uint8_t, kMaxOrdered>, 3> order_;
};

// Sweeps the references, sorted along one axis, from both sides. Replaces `best` by the cheapest cut if this cut costs
// less than `best`, or costs the same with a lower imbalance. Here the member `bin` of a cut is the number of
// references in its left part.
template <class S>
void find_cheapest_cut(BoxReferences<S> references, const Orders<S>& orders, size_t axis, Split<S>& best) {
  const size_t count = references.size();
  std::array<S, kMaxOrdered> right_cost;
  QuadBox<S> sum = QuadBox<S>::empty();
  for (size_t i = count - 1; i > 0; --i) {
    sum.add(references[orders.at(axis, i)].box());
    right_cost[i] = half_area(sum) * cost_of<S>(static_cast<uint32_t>(count - i));
  }
  sum = QuadBox<S>::empty();
  for (size_t i = 1; i < count; ++i) {
    sum.add(references[orders.at(axis, i - 1)].box());
    const S cost = half_area(sum) * cost_of<S>(static_cast<uint32_t>(i)) + right_cost[i];
    const auto imbalance = static_cast<uint32_t>(std::max(2 * i, count) - std::min(2 * i, count));
    if (cost < best.cost || (cost == best.cost && imbalance < best.imbalance))
      best = {static_cast<int>(axis), static_cast<uint32_t>(i), cost, imbalance};
  }
}

// Computes the bounds and the number of references of each bin.
template <class S>
void fill_bins(BoxReferences<S> references, const Binning<S>& binning, uint32_t bin_count, const BvhOptions& options,
               Bins<S>& bins) {
  for (size_t axis = 0; axis < 3; ++axis) {
    std::fill_n(bins.boxes[axis].begin(), bin_count, QuadBox<S>::empty());
    std::fill_n(bins.counts[axis].begin(), bin_count, 0u);
  }
  for_each_chunk(references, options, [&](BoxReferences<S> chunk) {
    for (const BoxReference<S>& reference : chunk) {
      const std::array<int32_t, 4> at = binning.bins_of(reference);
      for (size_t axis = 0; axis < 3; ++axis) {
        const auto bin = static_cast<size_t>(at[axis]);
        bins.boxes[axis][bin].add(reference.box());
        ++bins.counts[axis][bin];
      }
    }
  });
}

// Moves the references of the left part to the front, and computes the bounds of the centres of each part in the same
// loop. Every reference is swapped, even a reference of the right part, because a branch would be mispredicted half of
// the time.
template <class S>
Halves<S> partition(BoxReferences<S> references, const Binning<S>& binning, const Split<S>& split,
                    const BvhOptions& options) {
  const Quad<S> excluded = Quad<S>::splat(Aabb<S>::kInfinity), included = Quad<S>::splat(0);
  const std::array<Quad<S>, 3> offsets = {excluded, included, excluded};
  const auto bin = static_cast<int32_t>(split.bin);
  const auto axis = static_cast<size_t>(split.axis);
  Halves<S> halves;
  size_t left = 0;
  for_each_chunk(references, options, [&](BoxReferences<S> chunk) {
    for (BoxReference<S>& reference : chunk) {
      const BoxReference<S> moving = reference;
      const size_t goes_left = binning.bins_of(moving)[axis] < bin ? 1 : 0;
      const Quad<S> center = moving.center();
      for (size_t part = 0; part < 2; ++part) {
        QuadBox<S>& centers = halves.parts[part].centers;
        centers.min = minimum(center + offsets[part + goes_left], centers.min);
        centers.max = maximum(center - offsets[part + goes_left], centers.max);
      }
      reference = references[left];
      references[left] = moving;
      left += goes_left;
    }
  });
  halves.left_count = static_cast<uint32_t>(left);
  LOCUS_DCHECK_LE(left, references.size());
  return halves;
}

// Splits at the cheapest border between two bins of any axis. Returns left_count 0 if no border has a finite cost.
template <class S>
Halves<S> split_binned(BoxReferences<S> references, const Extent<S>& extent, const BvhOptions& options) {
  const auto count = static_cast<uint32_t>(references.size());
  LOCUS_DCHECK_GE(options.bins, 2);
  LOCUS_DCHECK_LE(options.bins, static_cast<int>(kMaxBvhBins));
  const uint32_t bin_count = std::min(static_cast<uint32_t>(options.bins), 4 + count / 16);
  const Binning<S> binning(extent.centers, bin_count);
  Bins<S> bins;
  fill_bins(references, binning, bin_count, options, bins);
  Split<S> best;
  for (size_t axis = 0; axis < 3; ++axis) find_cheapest_cut(bins, axis, bin_count, count, best);
  if (best.axis < 0) return {};
  Halves<S> halves = partition(references, binning, best, options);
  const auto axis = static_cast<size_t>(best.axis);
  for (uint32_t bin = 0; bin < bin_count; ++bin) halves.parts[bin < best.bin ? 0 : 1].bounds.add(bins.boxes[axis][bin]);
  return halves;
}

// Splits at the cheapest cut of the references sorted by centre along any axis. Returns left_count 0 if the areas
// overflow, so that no cut has a finite cost.
template <class S>
Halves<S> split_sorted(BoxReferences<S> references) {
  const Orders<S> orders(references);
  Split<S> best;
  for (size_t axis = 0; axis < 3; ++axis) find_cheapest_cut(references, orders, axis, best);
  if (best.axis < 0) return {};
  orders.apply(static_cast<size_t>(best.axis), references);
  return {best.bin, {extent_of<S>(references.subspan(0, best.bin)), extent_of<S>(references.subspan(best.bin))}};
}

// Splits at the median centre along the axis on which the centres spread most.
template <class S>
Halves<S> halve(BoxReferences<S> references, const QuadBox<S>& centers) {
  const Vec3<S> spread = centers.box().extent();
  const int axis = spread.x >= spread.y && spread.x >= spread.z ? 0 : spread.y >= spread.z ? 1 : 2;
  const size_t middle = references.size() / 2;
  // Equal centres are ordered by index, so that the halves do not depend on the current order of `references`.
  std::nth_element(references.begin(), references.begin() + middle, references.end(),
                   [axis](const BoxReference<S>& a, const BoxReference<S>& b) {
                     const S center_a = a.center()[axis], center_b = b.center()[axis];
                     return center_a != center_b ? center_a < center_b : a.index() < b.index();
                   });
  return {static_cast<uint32_t>(middle),
          {extent_of<S>(references.subspan(0, middle)), extent_of<S>(references.subspan(middle))}};
}

}  // namespace

template <class S>
Extent<S> extent_of(BoxReferences<S> references) {
  Extent<S> extent;
  for (const BoxReference<S>& reference : references) {
    extent.bounds.add(reference.box());
    extent.centers.add(reference.center());
  }
  return extent;
}

template <class S>
Halves<S> Splitter<S>::split(BoxReferences<S> references, const Extent<S>& extent, uint32_t levels) const {
  const auto count = static_cast<uint32_t>(references.size());
  LOCUS_DCHECK_LT(kBvhLeafSize, count);
  LOCUS_DCHECK_LE(balanced_levels(count), levels + 1);
  Halves<S> halves = count <= kMaxOrdered ? split_sorted(references) : split_binned(references, extent, options_);
  const bool found = halves.left_count != 0;
  if (!found || balanced_levels(std::max(halves.left_count, count - halves.left_count)) > levels)
    halves = halve(references, extent.centers);
  LOCUS_DCHECK_CALL(check_halves(references, extent, levels, halves));
  return halves;
}

template <class S>
void Splitter<S>::check_halves(BoxReferences<S> references, const Extent<S>& extent, uint32_t levels,
                               const Halves<S>& halves) const {
  if (cancelled(options_)) return;
  const auto count = static_cast<uint32_t>(references.size()), left_count = halves.left_count;
  LOCUS_DCHECK_LT(0u, left_count);
  LOCUS_DCHECK_LT(left_count, count);
  LOCUS_DCHECK_LE(balanced_levels(std::max(left_count, count - left_count)), levels);
  LOCUS_DCHECK(extent_of(references.subspan(0, left_count)).bounds.box() == halves.parts[0].bounds.box());
  LOCUS_DCHECK(extent_of(references.subspan(left_count)).bounds.box() == halves.parts[1].bounds.box());
  LOCUS_DCHECK(merge(halves.parts[0].bounds.box(), halves.parts[1].bounds.box()) == extent.bounds.box());
}

template Extent<float> extent_of(BoxReferences<float>);
template Extent<double> extent_of(BoxReferences<double>);
template class Splitter<float>;
template class Splitter<double>;

}  // namespace locus
