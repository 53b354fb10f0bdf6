#include "core/index/bvh/binary_tree.h"

#include <cmath>
#include <utility>
#include <vector>

#include "core/base/limits.h"
#include "core/index/bvh/splitter.h"

namespace locus {
namespace {

// Subtrees of up to so many references are built in one go by one thread. A constant, so that the tree does not depend
// on the number of threads.
constexpr uint32_t kSubtreeReferences = 4096;
constexpr size_t kPieceReferences = 1u << 16;  // that one thread measures at once
// Of all nodes of a tree together, against the area of its root, were every node to hold as many children as blocks.
constexpr double kNodeCost = 4;

}  // namespace

template <class S>
class BinaryBuilder {
 public:
  BinaryBuilder(BinaryTree<S>& tree, uint32_t count, const BvhOptions& options)
      : tree_(tree), references_(tree.references_.get(), count), options_(options), splitter_(options) {}

  // False when cancelled.
  bool build() {
    const Extent<S> whole = whole_extent();
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

  Extent<S> whole_extent() const {
    std::vector<Extent<S>> extents((references_.size() + kPieceReferences - 1) / kPieceReferences);
    for_each(options_, extents.size(),
             [&](size_t i) { extents[i] = extent_of(references_.subspan(i * kPieceReferences, kPieceReferences)); });
    Extent<S> whole;
    for (const Extent<S>& extent : extents) {
      whole.bounds.add(extent.bounds);
      whole.centers.add(extent.centers);
    }
    return whole;
  }

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

  // A node costs its share of the whole area and, so that there are few of them, a little besides.
  void measure_costs(const Extent<S>& whole, uint32_t count) {
    const double area = half_area(whole.bounds);
    area_share_ = area > 0 && std::isfinite(area) ? 1 / area : 0;
    node_cost_ = static_cast<float>(kNodeCost / blocks_for(count));
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
  const BoxReferences<S> references_;
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
