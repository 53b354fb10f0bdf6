#include "core/index/binary_tree.h"

#include <cmath>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/index/splitter.h"

namespace locus {
namespace {

// Maximum number of references in a subtree that one thread builds as one task. The number is a constant, so that the
// tree does not depend on the number of threads.
constexpr uint32_t kSubtreeReferences = 4096;
constexpr size_t kChunkReferences = 1u << 16;  // number of references whose Extent one task computes
// Numerator of the fixed cost of a node: the fixed cost is kNodeCost divided by the minimum number of blocks of the
// whole tree (see measure_costs()). The cost of a node is its fixed cost plus the ratio of its area to the root's area.
constexpr double kNodeCost = 4;

}  // namespace

template <class S>
class BinaryBuilder {
 public:
  BinaryBuilder(BinaryTree<S>& tree, uint32_t count, const BvhOptions& options)
      : tree_(tree), references_(tree.references_.get(), count), options_(options), splitter_(options) {}

  // Builds the tree. Returns false if the build was cancelled.
  bool build() {
    const Extent<S> total = total_extent();
    const auto count = static_cast<uint32_t>(references_.size());
    measure_costs(total, count);
    Nodes& top = tree_.nodes_.emplace_back();
    top.push_back({node_of(0, count, total), {}});
    const std::vector<Part> subtrees = split_top({&top[0][0], total, 1}, top);
    tree_.nodes_.resize(1 + subtrees.size());
    for_each(options_, subtrees.size(), [&](size_t i) { build_subtree(subtrees[i], tree_.nodes_[1 + i]); });
    if (cancelled(options_)) return false;
    choose_upwards(top);
    LOCUS_DCHECK_CALL(check_invariants());
    return true;
  }

 private:
  using Nodes = typename BinaryTree<S>::Nodes;

  // Node that is still to be split. `extent` holds the bounds of the node's references and of their centres; `depth` is
  // the number of nodes from the root to this node, 1 for the root.
  struct Part {
    BinaryNode<S>* node;
    Extent<S> extent;
    uint32_t depth;
  };

  Extent<S> total_extent() const {
    std::vector<Extent<S>> extents((references_.size() + kChunkReferences - 1) / kChunkReferences);
    for_each(options_, extents.size(),
             [&](size_t i) { extents[i] = extent_of(references_.subspan(i * kChunkReferences, kChunkReferences)); });
    Extent<S> total;
    for (const Extent<S>& extent : extents) {
      total.bounds.add(extent.bounds);
      total.centers.add(extent.centers);
    }
    return total;
  }

  static BinaryNode<S> node_of(uint32_t first, uint32_t count, const Extent<S>& extent) {
    BinaryNode<S> node;
    node.bounds = extent.bounds.box();
    node.first = first;
    node.count = count;
    return node;
  }

  // Splits, level by level, the nodes with more than kSubtreeReferences references. Returns the roots of the remaining
  // subtrees; one task builds each subtree.
  std::vector<Part> split_top(const Part& root, Nodes& nodes) const {
    std::vector<Part> small, level, next;
    const auto enqueue = [&](const Part& part) {
      (part.node->count <= kSubtreeReferences ? small : next).push_back(part);
    };
    enqueue(root);
    while (!next.empty() && !cancelled(options_)) {
      level.swap(next);
      next.clear();
      std::vector<Halves<S>> halves(level.size());
      for_each(options_, level.size(), [&](size_t i) { halves[i] = split(level[i]); });
      for (size_t i = 0; i < level.size() && !cancelled(options_); ++i)
        for (const Part& child : open(level[i], halves[i], nodes)) enqueue(child);
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
    LOCUS_DCHECK_LT(part.depth, limits::kMaxBvhDepth);
    return splitter_.split(references_.subspan(part.node->first, part.node->count), part.extent,
                           limits::kMaxBvhDepth - part.depth - 1);
  }

  static std::array<Part, 2> open(const Part& part, const Halves<S>& halves, Nodes& nodes) {
    BinaryNode<S>& node = *part.node;
    std::array<BinaryNode<S>, 2>& children = nodes.emplace_back();
    children[0] = node_of(node.first, halves.left_count, halves.parts[0]);
    children[1] = node_of(node.first + halves.left_count, node.count - halves.left_count, halves.parts[1]);
    node.children = children.data();
    return {Part{&children[0], halves.parts[0], part.depth + 1}, Part{&children[1], halves.parts[1], part.depth + 1}};
  }

  // Sets the two constants of a wide node's cost. area_share_ is the factor that makes the node's area relative to the
  // root's area. node_cost_ is a small fixed cost that keeps the number of nodes low.
  void measure_costs(const Extent<S>& total, uint32_t count) {
    const double area = half_area(total.bounds);
    area_share_ = area > 0 && std::isfinite(area) ? 1 / area : 0;
    node_cost_ = static_cast<float>(kNodeCost / blocks_for(count));
  }

  // Computes node.choice, which determines how the node is collapsed. Precondition: the choices of its children are
  // computed.
  void choose(BinaryNode<S>& node) const {
    if (node.is_leaf()) {
      LOCUS_DCHECK_LE(node.count, kBvhLeafSize);
      return;
    }
    const double share = area_share_ > 0 ? half_area(node.bounds) * area_share_ : 0;
    node.choice = WideChoice(node.children[0].choice, node.children[1].choice, static_cast<float>(share) + node_cost_);
  }

  void choose_upwards(Nodes& nodes) const {
    for (auto pair = nodes.rbegin(); pair != nodes.rend(); ++pair)
      for (BinaryNode<S>& node : *pair) choose(node);
  }

  // Verifies, in debug builds, that the two children of each inner node partition the node's references, and that the
  // node's bounds are the box around its children's bounds. O(nodes).
  void check_invariants() const {
    for (const Nodes& nodes : tree_.nodes_)
      for (const std::array<BinaryNode<S>, 2>& pair : nodes)
        for (const BinaryNode<S>& node : pair) LOCUS_DCHECK_CALL(check_node(node));
  }

  static void check_node(const BinaryNode<S>& node) {
    if (node.is_leaf()) return;
    const BinaryNode<S>& left = node.children[0];
    const BinaryNode<S>& right = node.children[1];
    LOCUS_DCHECK_LT(0u, left.count);
    LOCUS_DCHECK_LT(0u, right.count);
    LOCUS_DCHECK_EQ(left.first, node.first);
    LOCUS_DCHECK_EQ(right.first, left.first + left.count);
    LOCUS_DCHECK_EQ(left.count + right.count, node.count);
    LOCUS_DCHECK(merge(left.bounds, right.bounds) == node.bounds);
  }

  BinaryTree<S>& tree_;
  const BoxReferences<S> references_;
  const BvhOptions& options_;
  const Splitter<S> splitter_;
  double area_share_ = 0;
  float node_cost_ = 0;
};

template <class S>
absl::StatusOr<BinaryTree<S>> BinaryTree<S>::build(std::unique_ptr<BoxReference<S>[]> references, uint32_t count,
                                                   const BvhOptions& options) {
  LOCUS_DCHECK_LT(0u, count);
  LOCUS_DCHECK_LE(count, limits::kMaxBvhValues);
  BinaryTree tree;
  tree.references_ = std::move(references);
  if (!BinaryBuilder<S>(tree, count, options).build()) return cancelled_build();
  return tree;
}

template class BinaryTree<float>;
template class BinaryTree<double>;

}  // namespace locus
