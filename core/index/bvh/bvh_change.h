// Bvh::change(): makes a tree that differs in a few values from another tree and shares the other blocks with it.
//
// A value that is replaced, because it moved, keeps its place in its block, whose boxes are computed again. If the
// boxes of the block grow too much, the block is built again, without the values that have left its bounds; these are
// added like new values. A value is added to the block whose boxes it enlarges least, and the block is built again; a
// block that becomes too large is divided. The nodes above the blocks are built again only if the number of blocks
// changes. Blocks are not merged; if too many have few values, because of removals or divisions, the whole tree is
// built again.
#ifndef LOCUS_CORE_INDEX_BVH_BVH_CHANGE_H_
#define LOCUS_CORE_INDEX_BVH_BVH_CHANGE_H_

#include <algorithm>
#include <iterator>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include "core/index/bvh/bvh.h"

namespace locus {

// One call of Bvh::change().
template <class V, class T>
requires Bounded<V, T>
class BvhChanging {
  using Traits = T;
  using Tree = Bvh<V, T>;
  using S = typename T::Scalar;
  using Replacement = typename BvhChange<V>::Replacement;

 public:
  BvhChanging(const Tree& old, BvhChange<V> change) : old_(old), change_(std::move(change)) {}

  absl::StatusOr<typename Tree::Changed> run() {
    std::sort(change_.replaced.begin(), change_.replaced.end(),
              [](const Replacement& a, const Replacement& b) { return a.position < b.position; });
    std::sort(change_.removed.begin(), change_.removed.end());
    tree_ = old_;
    change_blocks();
    if ((change_.added.size() + change_.removed.size()) * kRebuiltShare >= old_.size()) return rebuild();
    add_values();
    for (auto& [block, values] : drafts_) RETURN_IF_ERROR(build_block(block, std::move(values)));
    drop_empty_blocks();
    if (tree_.blocks_.size() != old_.blocks_.size() || !added_blocks_.empty()) RETURN_IF_ERROR(link_blocks());
    tree_.measure();
    tree_.built_area_ = std::min(tree_.built_area_, tree_.area_);
    if (tree_.area_ > kGrowth * tree_.built_area_ || is_sparse()) {
      drafts_.clear();
      change_.added.clear();
      return rebuild();
    }
    LOCUS_DCHECK_CALL(tree_.check_invariants());
    std::sort(moved_.begin(), moved_.end());
    moved_.erase(std::unique(moved_.begin(), moved_.end()), moved_.end());
    const auto gone = std::lower_bound(moved_.begin(), moved_.end(), tree_.block_count());
    moved_.erase(gone, moved_.end());
    return typename Tree::Changed{std::move(tree_), std::move(moved_)};
  }

 private:
  // The whole tree is built if at least one of this number of values is added or removed.
  static constexpr size_t kRebuiltShare = 4;
  // A block, or the whole tree, is built again when the areas of its boxes have grown by this factor.
  static constexpr double kGrowth = 1.5;
  // The whole tree is built again if it has more blocks than this number, and than its values would need if the blocks
  // had this share of the values that blocks had when the whole tree was built.
  static constexpr double kFewBlocks = 16;
  static constexpr double kSparseShare = 0.25;

  bool is_sparse() const {
    const double needed = static_cast<double>(tree_.size_) / (kSparseShare * tree_.built_fill_);
    return static_cast<double>(tree_.blocks_.size()) > kFewBlocks + needed;
  }

  static uint32_t block_of(uint32_t position) { return position / kBvhBlockValues; }

  // Builds the whole tree from the values of all blocks, which are those of the draft if a block has one, and from the
  // added values.
  absl::StatusOr<typename Tree::Changed> rebuild() {
    std::vector<V> values;
    values.reserve(old_.size() + change_.added.size());
    for (uint32_t block = 0; block < tree_.block_count(); ++block) {
      if (const auto draft = drafts_.find(block); draft != drafts_.end())
        std::move(draft->second.begin(), draft->second.end(), std::back_inserter(values));
      else
        values.insert(values.end(), tree_.block(block).begin(), tree_.block(block).end());
    }
    std::move(change_.added.begin(), change_.added.end(), std::back_inserter(values));
    ASSIGN_OR_RETURN(Tree tree, Tree::build(std::move(values)));
    std::vector<uint32_t> all(tree.block_count());
    std::iota(all.begin(), all.end(), 0);
    return typename Tree::Changed{std::move(tree), std::move(all)};
  }

  // Applies the replacements and removals, block by block. Blocks that need new nodes become drafts.
  void change_blocks() {
    absl::Span<Replacement> replaced = absl::MakeSpan(change_.replaced);
    absl::Span<const uint32_t> removed = change_.removed;
    while (!replaced.empty() || !removed.empty()) {
      uint32_t block = tree_.block_count();
      if (!replaced.empty()) block = block_of(replaced.front().position);
      if (!removed.empty()) block = std::min(block, block_of(removed.front()));
      size_t replacements = 0, removals = 0;
      while (replacements < replaced.size() && block_of(replaced[replacements].position) == block) ++replacements;
      while (removals < removed.size() && block_of(removed[removals]) == block) ++removals;
      change_block(block, replaced.first(replacements), removed.first(removals));
      replaced.remove_prefix(replacements);
      removed.remove_prefix(removals);
    }
  }

  void change_block(uint32_t number, absl::Span<Replacement> replaced, absl::Span<const uint32_t> removed) {
    const BvhBlock<V, T>& old = *old_.blocks_[number].block;
    BvhBlock<V, T> block = old;
    for (Replacement& one : replaced) {
      V& value = block.values[one.position % kBvhBlockValues];
      LOCUS_DCHECK_EQ(Traits::id(value), Traits::id(one.value));
      value = std::move(one.value);
    }
    if (removed.empty()) {
      if (keep(number, block)) return;
    } else {
      std::vector<uint32_t> slots;
      for (const uint32_t position : removed) slots.push_back(position % kBvhBlockValues);
      if (BvhBlock<V, T> rest = block; remove_values(rest, slots) && keep(number, rest)) {
        moved_.push_back(number);
        return;
      }
    }
    std::vector<V>& rest = drafts_[number];
    rest.reserve(block.values.size());
    uint32_t position = number * kBvhBlockValues;
    for (V& value : block.values) {
      const bool is_removed = !removed.empty() && removed.front() == position;
      const bool is_replaced = !replaced.empty() && replaced.front().position == position;
      if (is_removed) removed.remove_prefix(1);
      if (is_replaced) replaced.remove_prefix(1);
      ++position;
      if (is_removed) continue;
      if (is_replaced && !contains(old.bounds, Traits::bounds(value)))
        change_.added.push_back(std::move(value));
      else
        rest.push_back(std::move(value));
    }
  }

  // Returns the values from which a block is built again; initially the values that the block has.
  std::vector<V>& draft_of(uint32_t block) {
    const auto [found, is_new] = drafts_.try_emplace(block);
    if (is_new) found->second = tree_.blocks_[block].block->values;
    return found->second;
  }

  // Returns the block to which a value is added.
  uint32_t block_for(const V& value) const {
    BvhChild now = old_.root_;
    while (!now.is_leaf()) {
      const BvhNode<S>& node = old_.nodes_[now.first];
      now = node.children[child_growing_least(node, Traits::bounds(value))];
    }
    return now.first;
  }

  void add_values() {
    std::map<uint32_t, std::vector<V>> added;
    for (V& value : change_.added) added[block_for(value)].push_back(std::move(value));
    for (auto& [number, values] : added) {
      if (drafts_.find(number) == drafts_.end() && values.size() <= kBvhLeafSize) {
        BvhBlock<V, T> block = *tree_.blocks_[number].block;
        const auto add = [&block](const V& value) { return add_value(block, value); };
        if (std::all_of(values.begin(), values.end(), add) && keep(number, block)) {
          moved_.push_back(number);
          continue;
        }
      }
      std::vector<V>& draft = draft_of(number);
      std::move(values.begin(), values.end(), std::back_inserter(draft));
    }
  }

  // Computes the boxes of a block whose values have changed, and moves the block into the tree. Returns false, and does
  // not move the block, if the boxes have grown too much.
  bool keep(uint32_t number, BvhBlock<V, T>& block) {
    refit(block);
    if (block.area > kGrowth * block.built_area) return false;
    block.built_area = std::min(block.built_area, block.area);
    tree_.blocks_[number] = BvhBlockSlot<V, T>(std::move(block));
    return true;
  }

  // Builds block `number` from its values. Values for which the block has no room become further blocks.
  absl::Status build_block(uint32_t number, std::vector<V> values) {
    moved_.push_back(number);
    if (values.empty()) {
      empty_.push_back(number);
      return absl::OkStatus();
    }
    ASSIGN_OR_RETURN(Tree built, Tree::build(std::move(values)));
    tree_.blocks_[number] = std::move(built.blocks_[0]);
    for (size_t i = 1; i < built.blocks_.size(); ++i) added_blocks_.push_back(std::move(built.blocks_[i]));
    return absl::OkStatus();
  }

  // Puts new blocks, and then the last blocks of the tree, in the places of empty ones.
  void drop_empty_blocks() {
    for (BvhBlockSlot<V, T>& block : added_blocks_) {
      if (empty_.empty()) {
        moved_.push_back(tree_.block_count());
        tree_.blocks_.push_back(std::move(block));
      } else {
        tree_.blocks_[empty_.back()] = std::move(block);
        empty_.pop_back();
      }
    }
    for (; !empty_.empty(); empty_.pop_back()) {
      if (empty_.back() + 1 != tree_.block_count()) {
        tree_.blocks_[empty_.back()] = std::move(tree_.blocks_.back());
        moved_.push_back(empty_.back());
      }
      tree_.blocks_.pop_back();
    }
  }

  // Builds the nodes above the blocks.
  absl::Status link_blocks() {
    std::vector<Aabb<S>> boxes;
    boxes.reserve(tree_.blocks_.size());
    for (const BvhBlockSlot<V, T>& slot : tree_.blocks_) boxes.push_back(slot.block->bounds);
    tree_.nodes_.clear();
    if (boxes.size() < 2) return absl::OkStatus();
    ASSIGN_OR_RETURN(BvhLayout<S> layout, build_bvh_layout<S>(boxes, BvhOptions{}));
    std::vector<BvhNode<S>>& nodes = layout.nodes;
    const size_t count = nodes.size();
    // In the layout, a leaf has up to kBvhLeafSize blocks. It becomes a node whose children are these blocks.
    const auto add_blocks = [&](BvhNode<S>& node, BvhChild leaf) {
      node.child_count = leaf.count;
      for (uint32_t slot = 0; slot < leaf.count; ++slot) {
        const uint32_t block = layout.order[leaf.first + slot];
        node.children[slot] = child_of(block, tree_.blocks_[block]);
      }
    };
    static_assert(kBvhLeafSize <= kBvhWidth);
    for (size_t index = 0; index < count; ++index) {
      for (uint32_t slot = 0; slot < nodes[index].child_count; ++slot) {
        const BvhChild child = nodes[index].children[slot];
        if (!child.is_leaf()) continue;
        if (child.count == 1) {
          const uint32_t block = layout.order[child.first];
          nodes[index].children[slot] = child_of(block, tree_.blocks_[block]);
        } else if (nodes[index].child_count == 1) {
          add_blocks(nodes[index], child);
          break;
        } else {
          nodes[index].children[slot] = {static_cast<uint32_t>(nodes.size()), 0};
          add_blocks(nodes.emplace_back(), child);
        }
      }
    }
    tree_.nodes_ = std::move(nodes);
    return absl::OkStatus();
  }

  const Tree& old_;
  BvhChange<V> change_;
  Tree tree_;
  std::map<uint32_t, std::vector<V>> drafts_;  // values of the blocks that are built again
  std::vector<BvhBlockSlot<V, T>> added_blocks_;
  std::vector<uint32_t> empty_;  // blocks without values, ascending
  std::vector<uint32_t> moved_;  // see Bvh::Changed::blocks
};

template <class V, class T>
requires Bounded<V, T> absl::StatusOr<typename Bvh<V, T>::Changed> Bvh<V, T>::change(BvhChange<V> change)
const {
  if (change.empty()) return Changed{*this, {}};
  return BvhChanging<V, T>(*this, std::move(change)).run();
}

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_BVH_CHANGE_H_
