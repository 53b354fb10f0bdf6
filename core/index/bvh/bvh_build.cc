#include "core/index/bvh/bvh_build.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/base/refusal.h"

namespace locus {
namespace {

using limits::kMaxBvhBins;
using limits::kMaxBvhDepth;

constexpr uint32_t blocks(uint32_t count) { return (count + kBvhLeafSize - 1) / kBvhLeafSize; }

// Levels that halving needs below a range until its parts fit leaves.
constexpr uint32_t balanced_levels(uint32_t count) { return static_cast<uint32_t>(std::bit_width(blocks(count) - 1)); }

static_assert(balanced_levels(8) == 0 && balanced_levels(9) == 1 && balanced_levels(17) == 2);
static_assert(balanced_levels(limits::kMaxBvhValues) < kMaxBvhDepth, "halving alone stays within the depth limit");

template <class S>
Vec3<S> center_of(const Aabb<S>& box) {
  return box.min * S{0.5} + box.max * S{0.5};
}

template <class S>
struct Reference {
  Aabb<S> bounds;
  uint32_t index;
};

// `left` is 0 for a leaf: the root is nobody's child.
template <class S>
struct BinaryNode {
  Aabb<S> bounds;
  uint32_t first, count;
  uint32_t left = 0, right = 0;
};

struct Split {
  int axis = -1;  // none found
  int bin = 0;    // first bin of the right part
  double cost = std::numeric_limits<double>::infinity();
};

template <class S>
struct Bin {
  Aabb<S> bounds;
  uint32_t count = 0;
};

// Maps centres to bins along one axis. Unusable where all centres coincide or their spread is beyond the arithmetic.
template <class S>
class Binning {
 public:
  Binning(const Aabb<S>& centers, int axis, int bins)
      : axis_(axis),
        last_(bins - 1),
        low_(centers.min[axis]),
        scale_(bins / (double{centers.max[axis]} - double{centers.min[axis]})) {}

  bool usable() const { return scale_ > 0 && std::isfinite(scale_); }
  int bin_of(const Aabb<S>& box) const {
    return std::min(last_, static_cast<int>((double{center_of(box)[axis_]} - low_) * scale_));
  }

 private:
  int axis_;
  int last_;
  double low_;
  double scale_;
};

// Sweeps the bins from both sides; keeps the cheapest cut in `best`.
template <class S>
void find_cheapest_cut(absl::Span<const Bin<S>> bins, int axis, Split& best) {
  std::array<double, kMaxBvhBins> right_cost;
  Bin<S> sum;
  for (size_t i = bins.size() - 1; i > 0; --i) {
    sum = {merge(sum.bounds, bins[i].bounds), sum.count + bins[i].count};
    right_cost[i] = sum.count == 0 ? 0 : double{half_area(sum.bounds)} * blocks(sum.count);
  }
  const uint32_t right_total = sum.count;
  const uint32_t total = right_total + bins[0].count;
  sum = {};
  for (size_t i = 1; i < bins.size(); ++i) {
    sum = {merge(sum.bounds, bins[i - 1].bounds), sum.count + bins[i - 1].count};
    if (sum.count == 0 || sum.count == total) continue;
    const double cost = double{half_area(sum.bounds)} * blocks(sum.count) + right_cost[i];
    if (cost < best.cost) best = {axis, static_cast<int>(i), cost};
  }
}

template <class S>
class BinaryBuilder {
  using References = absl::Span<Reference<S>>;

 public:
  BinaryBuilder(std::vector<Reference<S>>& references, const BvhOptions& options)
      : references_(references), options_(options) {}

  // The nodes, root first; the references end up in depth-first order. CANCELLED when told to stop.
  absl::StatusOr<std::vector<BinaryNode<S>>> build() {
    struct Pending {
      uint32_t node;
      uint32_t depth;
    };
    std::vector<Pending> pending = {{add_node(0, static_cast<uint32_t>(references_.size())), 1}};
    while (!pending.empty()) {
      if (options_.cancel != nullptr && options_.cancel->load(std::memory_order_relaxed))
        return absl::CancelledError("the build of the tree was cancelled");
      const Pending now = pending.back();
      pending.pop_back();
      const BinaryNode<S> node = nodes_[now.node];
      if (node.count <= kBvhLeafSize) continue;
      const uint32_t left_count = partition(node, now.depth);
      const uint32_t left = add_node(node.first, left_count);
      const uint32_t right = add_node(node.first + left_count, node.count - left_count);
      nodes_[now.node].left = left;
      nodes_[now.node].right = right;
      pending.push_back({right, now.depth + 1});
      pending.push_back({left, now.depth + 1});
    }
    return std::move(nodes_);
  }

 private:
  References range(const BinaryNode<S>& node) { return absl::MakeSpan(references_).subspan(node.first, node.count); }

  uint32_t add_node(uint32_t first, uint32_t count) {
    BinaryNode<S> node{{}, first, count};
    for (const Reference<S>& reference : range(node)) node.bounds = merge(node.bounds, reference.bounds);
    nodes_.push_back(node);
    return static_cast<uint32_t>(nodes_.size() - 1);
  }

  // Reorders the references of `node`; returns how many come first. By the heuristic, or by halves where it finds
  // nothing or would leave too few levels to halve the larger part.
  uint32_t partition(const BinaryNode<S>& node, uint32_t depth) {
    Aabb<S> centers;
    for (const Reference<S>& reference : range(node)) centers = merge(centers, center_of(reference.bounds));
    const int bins = static_cast<int>(std::min<uint32_t>(options_.bins, 4 + node.count / 16));
    const Split split = cheapest_split(range(node), centers, bins);
    if (split.axis >= 0) {
      const Binning<S> binning(centers, split.axis, bins);
      const auto middle = std::partition(range(node).begin(), range(node).end(), [&](const Reference<S>& reference) {
        return binning.bin_of(reference.bounds) < split.bin;
      });
      const uint32_t left = static_cast<uint32_t>(middle - range(node).begin());
      if (depth + 1 + balanced_levels(std::max(left, node.count - left)) <= kMaxBvhDepth) return left;
    }
    return partition_in_halves(range(node), centers);
  }

  static Split cheapest_split(References references, const Aabb<S>& centers, int bin_count) {
    Split best;
    for (int axis = 0; axis < 3; ++axis) {
      const Binning<S> binning(centers, axis, bin_count);
      if (!binning.usable()) continue;
      std::array<Bin<S>, kMaxBvhBins> bins;
      for (const Reference<S>& reference : references) {
        Bin<S>& bin = bins[static_cast<size_t>(binning.bin_of(reference.bounds))];
        bin = {merge(bin.bounds, reference.bounds), bin.count + 1};
      }
      find_cheapest_cut<S>(absl::MakeSpan(bins).subspan(0, static_cast<size_t>(bin_count)), axis, best);
    }
    return best;
  }

  static uint32_t partition_in_halves(References references, const Aabb<S>& centers) {
    const Vec3<S> spread = centers.extent();
    const int axis = spread.x >= spread.y && spread.x >= spread.z ? 0 : spread.y >= spread.z ? 1 : 2;
    const auto middle = references.begin() + static_cast<ptrdiff_t>(references.size() / 2);
    // The index decides between equal centres, so that the halves do not depend on the order found here.
    std::nth_element(references.begin(), middle, references.end(), [axis](const auto& a, const auto& b) {
      const S center_a = center_of(a.bounds)[axis], center_b = center_of(b.bounds)[axis];
      return center_a != center_b ? center_a < center_b : a.index < b.index;
    });
    return static_cast<uint32_t>(middle - references.begin());
  }

  std::vector<Reference<S>>& references_;
  const BvhOptions& options_;
  std::vector<BinaryNode<S>> nodes_;
};

// The children of one wide node, left to right: the binary node's two, then again and again the largest inner one
// replaced by its own two.
template <class S>
class Opened {
 public:
  Opened(const std::vector<BinaryNode<S>>& tree, uint32_t root) : tree_(tree) {
    nodes_[size_++] = root;
    while (size_ < kBvhWidth && open_largest()) continue;
  }
  absl::Span<const uint32_t> nodes() const { return {nodes_.data(), size_}; }

 private:
  // Among equal areas the fuller one, so that coincident boxes give a balanced tree.
  static bool worth_more(const BinaryNode<S>& a, const BinaryNode<S>& b) {
    const S area_a = half_area(a.bounds), area_b = half_area(b.bounds);
    return area_a != area_b ? area_a > area_b : a.count > b.count;
  }

  bool open_largest() {
    size_t largest = size_;
    for (size_t i = 0; i < size_; ++i) {
      if (tree_[nodes_[i]].left == 0) continue;
      if (largest == size_ || worth_more(tree_[nodes_[i]], tree_[nodes_[largest]])) largest = i;
    }
    if (largest == size_) return false;
    const BinaryNode<S>& node = tree_[nodes_[largest]];
    std::copy_backward(nodes_.begin() + largest + 1, nodes_.begin() + size_, nodes_.begin() + size_ + 1);
    nodes_[largest] = node.left;
    nodes_[largest + 1] = node.right;
    ++size_;
    return true;
  }

  const std::vector<BinaryNode<S>>& tree_;
  std::array<uint32_t, kBvhWidth> nodes_{};
  size_t size_ = 0;
};

template <class S>
void collapse(const std::vector<BinaryNode<S>>& tree, BvhLayout<S>& layout) {
  struct Pending {
    uint32_t binary_node;
    uint32_t parent, slot;  // where to write the number of the new node
    uint32_t depth;
  };
  std::vector<Pending> pending = {{0, 0, 0, 1}};
  while (!pending.empty()) {
    const Pending now = pending.back();
    pending.pop_back();
    const uint32_t number = static_cast<uint32_t>(layout.nodes.size());
    if (number != 0) layout.nodes[now.parent].children[now.slot] = {number, 0};
    BvhNode<S>& node = layout.nodes.emplace_back();
    layout.depth = std::max(layout.depth, now.depth);
    const Opened<S> opened(tree, now.binary_node);
    node.child_count = static_cast<uint32_t>(opened.nodes().size());
    // Backwards, so that the first child is the next to be taken: depth-first order.
    for (uint32_t slot = node.child_count; slot-- > 0;) {
      const BinaryNode<S>& child = tree[opened.nodes()[slot]];
      node.bounds[slot] = child.bounds;
      if (child.left == 0) {
        node.children[slot] = {child.first, child.count};
      } else {
        pending.push_back({opened.nodes()[slot], number, slot, now.depth + 1});
      }
    }
  }
}

template <class S>
absl::Status check_input(absl::Span<const Aabb<S>> boxes, const BvhOptions& options) {
  if (options.bins < 2 || options.bins > static_cast<int>(kMaxBvhBins))
    return refuse_argument(Reason::kOutOfRange, "bins", std::nullopt, "must be 2 to 64");
  if (boxes.size() > limits::kMaxBvhValues)
    return refuse_limit("values", "max_bvh_values", limits::kMaxBvhValues, static_cast<double>(boxes.size()));
  for (size_t i = 0; i < boxes.size(); ++i) {
    if (!is_finite(boxes[i].min) || !is_finite(boxes[i].max) || boxes[i].empty())
      return refuse_argument(Reason::kNotFinite, "values", static_cast<uint32_t>(i), "its bounds must be finite");
  }
  return absl::OkStatus();
}

}  // namespace

template <class S>
absl::StatusOr<BvhLayout<S>> build_bvh_layout(absl::Span<const Aabb<S>> boxes, const BvhOptions& options) {
  if (absl::Status status = check_input(boxes, options); !status.ok()) return status;
  BvhLayout<S> layout;
  if (boxes.empty()) return layout;
  std::vector<Reference<S>> references;
  references.reserve(boxes.size());
  for (const Aabb<S>& box : boxes) references.push_back({box, static_cast<uint32_t>(references.size())});
  absl::StatusOr<std::vector<BinaryNode<S>>> tree = BinaryBuilder<S>(references, options).build();
  if (!tree.ok()) return tree.status();
  collapse(*tree, layout);
  layout.bounds = tree->front().bounds;
  layout.order.reserve(references.size());
  for (const Reference<S>& reference : references) layout.order.push_back(reference.index);
  LOCUS_CHECK_LE(layout.depth, kMaxBvhDepth);
  LOCUS_CHECK_LT(layout.nodes.size(), 2 * boxes.size());
  return layout;
}

template absl::StatusOr<BvhLayout<float>> build_bvh_layout(absl::Span<const Aabbf>, const BvhOptions&);
template absl::StatusOr<BvhLayout<double>> build_bvh_layout(absl::Span<const Aabbd>, const BvhOptions&);

}  // namespace locus
