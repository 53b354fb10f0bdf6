#include "core/index/bsp_tree/bsp_space.h"

#include <algorithm>
#include <utility>

namespace locus {

uint32_t BspSpace::depth() const {
  uint32_t depth = 0;
  for (const BspNode& node : nodes_)
    if (node.parent != BspNode::kNotInUse) depth = std::max(depth, node.depth);
  return depth;
}

uint32_t BspSpace::divide(uint32_t leaf, const Plane& plane) {
  LOCUS_DCHECK(nodes_[leaf].is_leaf());
  LOCUS_CHECK_LT(nodes_[leaf].depth, limits::kMaxBspDepth);
  uint32_t child;
  if (free_.empty()) {
    child = static_cast<uint32_t>(nodes_.size());
    nodes_.resize(nodes_.size() + 2);
  } else {
    child = free_.back();
    free_.pop_back();
  }
  nodes_[leaf].plane = plane;
  nodes_[leaf].child = child;
  for (const uint32_t side : {child, child + 1}) {
    nodes_[side].parent = leaf;
    nodes_[side].depth = nodes_[leaf].depth + 1;
    nodes_[side].limit = nodes_[leaf].limit;
  }
  LOCUS_DCHECK_CALL(check_invariants(leaf));
  return child;
}

void BspSpace::join(uint32_t node) {
  const uint32_t child = std::exchange(nodes_[node].child, 0);
  LOCUS_DCHECK_LT(0u, child);
  for (const uint32_t side : {child, child + 1}) {
    LOCUS_DCHECK(nodes_[side].is_leaf());
    nodes_[side].parent = BspNode::kNotInUse;
    nodes_[side].references = {};
    ++nodes_[side].uses;
  }
  free_.push_back(child);
}

void BspSpace::clear() {
  free_.clear();
  for (uint32_t child = 1; child < nodes_.size(); child += 2) {
    for (const uint32_t side : {child, child + 1}) {
      BspNode& node = nodes_[side];
      if (node.parent != BspNode::kNotInUse) ++node.uses;
      node.parent = BspNode::kNotInUse;
      node.child = 0;
      node.references = {};
    }
    free_.push_back(child);
  }
  nodes_[BspNode::kRoot].child = 0;
  nodes_[BspNode::kRoot].references = {};
}

bool BspSpace::has_cell(CellNumber cell) const {
  const uint64_t index = cell & 0xFFFFFFFFu;
  if (index >= nodes_.size()) return false;
  const BspNode& node = nodes_[index];
  return node.parent != BspNode::kNotInUse && node.uses == cell >> 32;
}

uint32_t BspSpace::node_of(CellNumber cell) const {
  LOCUS_CHECK(has_cell(cell));
  return static_cast<uint32_t>(cell);
}

uint32_t BspSpace::leaf_of(const Vec3d& point) const {
  uint32_t index = BspNode::kRoot;
  while (!nodes_[index].is_leaf())
    index = nodes_[index].child + (signed_distance(nodes_[index].plane, point) >= 0 ? 0 : 1);
  return index;
}

std::vector<Plane> BspSpace::planes_around(uint32_t node) const {
  std::vector<Plane> planes;
  for (; node != BspNode::kRoot; node = nodes_[node].parent) {
    const BspNode& parent = nodes_[nodes_[node].parent];
    const bool front = parent.child == node;
    planes.push_back(front ? parent.plane : Plane{-parent.plane.normal, -parent.plane.offset});
  }
  return planes;
}

void BspSpace::check_invariants(uint32_t node) const {
  LOCUS_DCHECK_LE(nodes_[node].depth, limits::kMaxBspDepth);
  if (nodes_[node].is_leaf()) return;
  for (const uint32_t side : {nodes_[node].child, nodes_[node].child + 1}) {
    LOCUS_DCHECK_EQ(nodes_[side].parent, node);
    LOCUS_DCHECK_EQ(nodes_[side].depth, nodes_[node].depth + 1);
  }
}

}  // namespace locus
