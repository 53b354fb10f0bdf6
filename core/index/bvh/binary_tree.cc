#include "core/index/bvh/binary_tree.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "core/base/limits.h"

namespace locus {
namespace {

using limits::kMaxBvhBins;
using limits::kMaxBvhDepth;

// Subtrees of up to so many references are built in one go by one thread. A constant, so that the tree does not depend
// on the number of threads.
constexpr uint32_t kSubtreeReferences = 4096;
// Of all nodes of a tree together, against the area of its root, were every node to hold as many children as blocks.
constexpr double kNodeCost = 0.25;
// References between two looks at the cancel flag.
constexpr size_t kReferencesBetweenChecks = 1u << 16;

constexpr uint32_t blocks(uint32_t count) { return (count + kBvhLeafSize - 1) / kBvhLeafSize; }

// Levels that halving needs below a range until its parts fit leaves.
constexpr uint32_t balanced_levels(uint32_t count) { return static_cast<uint32_t>(std::bit_width(blocks(count) - 1)); }

static_assert(balanced_levels(8) == 0 && balanced_levels(9) == 1 && balanced_levels(17) == 2);
static_assert(balanced_levels(limits::kMaxBvhValues) < kMaxBvhDepth, "halving alone stays within the depth limit");

// Bounds of references, and of their centres.
template <class S>
struct Extent {
  QuadBox<S> bounds;
  QuadBox<S> centers;
};

template <class S>
using References = absl::Span<BoxReference<S>>;

// Calls `each` for pieces of `references` in turn. False when told to stop.
template <class S, class Each>
bool in_pieces(References<S> references, const BvhOptions& options, Each each) {
  while (!references.empty()) {
    if (cancelled(options)) return false;
    each(references.subspan(0, kReferencesBetweenChecks));
    references.remove_prefix(std::min(references.size(), kReferencesBetweenChecks));
  }
  return true;
}

template <class S>
Extent<S> extent_of(References<S> references) {
  Extent<S> extent;
  for (const BoxReference<S>& reference : references) {
    extent.bounds.add(reference.box());
    extent.centers.add(reference.center());
  }
  return extent;
}

// Maps centres to bins along all axes at once. An axis where all centres coincide, or their spread is beyond the
// arithmetic, has one bin.
template <class S>
class Binning {
 public:
  Binning(const QuadBox<S>& centers, uint32_t bins) : low_(centers.min), last_(Quad<S>::all(static_cast<S>(bins - 1))) {
    std::array<S, 3> scale{};
    for (int axis = 0; axis < 3; ++axis) {
      const S wanted = static_cast<S>(bins) / (centers.max[axis] - centers.min[axis]);
      if (wanted > 0 && std::isfinite(wanted)) scale[static_cast<size_t>(axis)] = wanted;
    }
    scale_ = Quad<S>::of(scale[0], scale[1], scale[2], 0);
  }

  std::array<int32_t, 4> bins_of(const BoxReference<S>& reference) const {
    const Quad<S> place = (reference.center() - low_) * scale_;
    return lesser(greater(place, Quad<S>::all(0)), last_).whole();
  }

 private:
  Quad<S> low_, last_, scale_;
};

template <class S>
struct Bins {
  std::array<std::array<QuadBox<S>, kMaxBvhBins>, 3> boxes;
  std::array<std::array<uint32_t, kMaxBvhBins>, 3> counts;
};

template <class S>
struct Split {
  int axis = -1;     // none found
  uint32_t bin = 0;  // first bin of the right part
  S cost = std::numeric_limits<S>::infinity();
};

// Sweeps one axis' bins from both sides; keeps the cheapest cut in `best`.
template <class S>
void find_cheapest_cut(const Bins<S>& bins, size_t axis, uint32_t bin_count, uint32_t total, Split<S>& best) {
  std::array<S, kMaxBvhBins> right_cost;
  QuadBox<S> sum;
  uint32_t count = 0;
  for (size_t i = bin_count - 1; i > 0; --i) {
    sum.add(bins.boxes[axis][i]);
    count += bins.counts[axis][i];
    right_cost[i] = count == 0 ? 0 : half_area(sum) * static_cast<S>(blocks(count));
  }
  sum = {};
  count = 0;
  for (size_t i = 1; i < bin_count; ++i) {
    sum.add(bins.boxes[axis][i - 1]);
    count += bins.counts[axis][i - 1];
    if (count == 0 || count == total) continue;
    const S cost = half_area(sum) * static_cast<S>(blocks(count)) + right_cost[i];
    if (cost < best.cost) best = {static_cast<int>(axis), static_cast<uint32_t>(i), cost};
  }
}

// Two parts of a range of references, each with its extent.
template <class S>
struct Halves {
  uint32_t left_count = 0;
  std::array<Extent<S>, 2> parts;
};

// Splits ranges of references; needs no other memory.
template <class S>
class Splitter {
 public:
  explicit Splitter(const BvhOptions& options) : options_(options) {}

  // By the heuristic, or by halves where it finds nothing or would leave too few of the `levels` below to halve the
  // larger part. Means nothing once the build is cancelled.
  Halves<S> split(References<S> references, const Extent<S>& extent, uint32_t levels) const {
    const auto count = static_cast<uint32_t>(references.size());
    const uint32_t bin_count = std::min(static_cast<uint32_t>(options_.bins), 4 + count / 16);
    const Binning<S> binning(extent.centers, bin_count);
    Bins<S> bins;
    fill(references, binning, bin_count, bins);
    Split<S> best;
    for (size_t axis = 0; axis < 3; ++axis) find_cheapest_cut(bins, axis, bin_count, count, best);
    if (best.axis < 0) return halve(references, extent.centers);
    Halves<S> halves = partition(references, binning, best);
    if (balanced_levels(std::max(halves.left_count, count - halves.left_count)) > levels)
      return halve(references, extent.centers);
    const auto axis = static_cast<size_t>(best.axis);
    for (uint32_t bin = 0; bin < bin_count; ++bin)
      halves.parts[bin < best.bin ? 0 : 1].bounds.add(bins.boxes[axis][bin]);
    return halves;
  }

 private:
  void fill(References<S> references, const Binning<S>& binning, uint32_t bin_count, Bins<S>& bins) const {
    for (size_t axis = 0; axis < 3; ++axis) {
      std::fill_n(bins.boxes[axis].begin(), bin_count, QuadBox<S>{});
      std::fill_n(bins.counts[axis].begin(), bin_count, 0u);
    }
    in_pieces(references, options_, [&](References<S> piece) {
      for (const BoxReference<S>& reference : piece) {
        const std::array<int32_t, 4> at = binning.bins_of(reference);
        for (size_t axis = 0; axis < 3; ++axis) {
          const auto bin = static_cast<size_t>(at[axis]);
          bins.boxes[axis][bin].add(reference.box());
          ++bins.counts[axis][bin];
        }
      }
    });
  }

  // The left part first. Every reference is swapped, whichever way it goes: a branch here would be mispredicted half of
  // the time.
  Halves<S> partition(References<S> references, const Binning<S>& binning, const Split<S>& split) const {
    const Quad<S> nowhere = Quad<S>::all(Aabb<S>::kInfinity), here = Quad<S>::all(0);
    const std::array<Quad<S>, 3> away = {nowhere, here, nowhere};
    const auto bin = static_cast<int32_t>(split.bin);
    const auto axis = static_cast<size_t>(split.axis);
    Halves<S> halves;
    size_t left = 0;
    in_pieces(references, options_, [&](References<S> piece) {
      for (BoxReference<S>& reference : piece) {
        const BoxReference<S> moving = reference;
        const size_t goes_left = binning.bins_of(moving)[axis] < bin ? 1 : 0;
        const Quad<S> center = moving.center();
        for (size_t part = 0; part < 2; ++part) {
          QuadBox<S>& centers = halves.parts[part].centers;
          centers.min = lesser(center + away[part + goes_left], centers.min);
          centers.max = greater(center - away[part + goes_left], centers.max);
        }
        reference = references[left];
        references[left] = moving;
        left += goes_left;
      }
    });
    halves.left_count = static_cast<uint32_t>(left);
    return halves;
  }

  static Halves<S> halve(References<S> references, const QuadBox<S>& centers) {
    const Vec3<S> spread = centers.box().extent();
    const int axis = spread.x >= spread.y && spread.x >= spread.z ? 0 : spread.y >= spread.z ? 1 : 2;
    const size_t middle = references.size() / 2;
    // The index decides between equal centres, so that the halves do not depend on the order found here.
    std::nth_element(references.begin(), references.begin() + middle, references.end(),
                     [axis](const BoxReference<S>& a, const BoxReference<S>& b) {
                       const S center_a = a.center()[axis], center_b = b.center()[axis];
                       return center_a != center_b ? center_a < center_b : a.index() < b.index();
                     });
    return {static_cast<uint32_t>(middle),
            {extent_of<S>(references.subspan(0, middle)), extent_of<S>(references.subspan(middle))}};
  }

  const BvhOptions& options_;
};

}  // namespace

template <class S>
class BinaryBuilder {
 public:
  BinaryBuilder(BinaryTree<S>& tree, uint32_t count, const BvhOptions& options)
      : tree_(tree), references_(tree.references_.get(), count), options_(options), splitter_(options) {}

  // False when cancelled.
  bool build() {
    const Extent<S> whole = extent_of(references_);
    const auto count = static_cast<uint32_t>(references_.size());
    measure_costs(whole, count);
    Nodes& top = tree_.nodes_.emplace_back();
    top.push_back({node_of(0, count, whole), {}});
    const std::vector<Part> subtrees = split_top({&top[0][0], whole, 1}, top);
    tree_.nodes_.resize(1 + subtrees.size());
    for_each(options_, subtrees.size(), [&](size_t i) { build_subtree(subtrees[i], tree_.nodes_[1 + i]); });
    if (cancelled(options_)) return false;
    choose_upwards(top);
    return true;
  }

 private:
  using Nodes = typename BinaryTree<S>::Nodes;

  // A node, at first without children.
  struct Part {
    BinaryNode<S>* node;
    Extent<S> extent;
    uint32_t depth;
  };

  static BinaryNode<S> node_of(uint32_t first, uint32_t count, const Extent<S>& extent) {
    BinaryNode<S> node;
    node.bounds = extent.bounds.box();
    node.first = first;
    node.count = count;
    return node;
  }

  // Splits what is too large for one go, level by level; returns the rest.
  std::vector<Part> split_top(const Part& root, Nodes& nodes) const {
    std::vector<Part> small, wave, next;
    const auto sort_in = [&](const Part& part) {
      (part.node->count <= kSubtreeReferences ? small : next).push_back(part);
    };
    sort_in(root);
    while (!next.empty() && !cancelled(options_)) {
      wave.swap(next);
      next.clear();
      std::vector<Halves<S>> halves(wave.size());
      for_each(options_, wave.size(), [&](size_t i) { halves[i] = split(wave[i]); });
      for (size_t i = 0; i < wave.size() && !cancelled(options_); ++i)
        for (const Part& child : open(wave[i], halves[i], nodes)) sort_in(child);
    }
    return small;
  }

  void build_subtree(const Part& root, Nodes& nodes) const {
    std::vector<Part> pending = {root};
    while (!pending.empty()) {
      if (cancelled(options_)) return;
      const Part now = pending.back();
      pending.pop_back();
      if (now.node->count <= kBvhLeafSize) continue;
      for (const Part& child : open(now, split(now), nodes)) pending.push_back(child);
    }
    choose_upwards(nodes);
    choose(*root.node);
  }

  Halves<S> split(const Part& part) const {
    return splitter_.split(references_.subspan(part.node->first, part.node->count), part.extent,
                           kMaxBvhDepth - part.depth - 1);
  }

  static std::array<Part, 2> open(const Part& part, const Halves<S>& halves, Nodes& nodes) {
    BinaryNode<S>& node = *part.node;
    std::array<BinaryNode<S>, 2>& children = nodes.emplace_back();
    children[0] = node_of(node.first, halves.left_count, halves.parts[0]);
    children[1] = node_of(node.first + halves.left_count, node.count - halves.left_count, halves.parts[1]);
    node.children = children.data();
    return {Part{&children[0], halves.parts[0], part.depth + 1}, Part{&children[1], halves.parts[1], part.depth + 1}};
  }

  // A node costs its share of the whole area and, so that there are few of them, a little besides.
  void measure_costs(const Extent<S>& whole, uint32_t count) {
    const double area = half_area(whole.bounds);
    area_share_ = area > 0 && std::isfinite(area) ? 1 / area : 0;
    node_cost_ = static_cast<float>(kNodeCost / blocks(count));
  }

  void choose(BinaryNode<S>& node) const {
    if (node.is_leaf()) return;
    const double share = area_share_ > 0 ? half_area(node.bounds) * area_share_ : 0;
    node.choice = WideChoice(node.children[0].choice, node.children[1].choice, static_cast<float>(share) + node_cost_);
  }

  void choose_upwards(Nodes& nodes) const {
    for (auto pair = nodes.rbegin(); pair != nodes.rend(); ++pair)
      for (BinaryNode<S>& node : *pair) choose(node);
  }

  BinaryTree<S>& tree_;
  const References<S> references_;
  const BvhOptions& options_;
  const Splitter<S> splitter_;
  double area_share_ = 0;
  float node_cost_ = 0;
};

template <class S>
absl::StatusOr<BinaryTree<S>> BinaryTree<S>::build(std::unique_ptr<BoxReference<S>[]> references, uint32_t count,
                                                   const BvhOptions& options) {
  BinaryTree tree;
  tree.references_ = std::move(references);
  if (!BinaryBuilder<S>(tree, count, options).build()) return cancelled_build();
  return tree;
}

template class BinaryTree<float>;
template class BinaryTree<double>;

}  // namespace locus
