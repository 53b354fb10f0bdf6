#include "core/index/bvh/triangle_writer.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/base/check.h"
#include "core/index/bvh/triangle_parts.h"

namespace locus {

static_assert(kBvhWidth == kTreeWidth && kBvhLeafSize == kTreeWidth);

namespace {

// Maximum number of triangles in a subtree that is written as one chunk. The resulting tree does not depend on this
// number.
constexpr uint32_t kMaxSubtreeTriangles = 8192;

// Returns the children of a wide node in order of increasing area.
WideChildren<float> children_by_area(const BinaryNode<float>& root) {
  WideChildren<float> children(root);
  children.sort_by_area();
  return children;
}

}  // namespace

TriangleArrays TriangleWriter::write() {
  std::vector<Chunk> chunks = split_into_chunks();
  std::vector<Offsets> sizes(chunks.size());
  for_each(options_, chunks.size(), [&](size_t i) { sizes[i] = count(chunks[i]); });
  Offsets end;
  for (size_t i = 0; i < chunks.size(); ++i) {
    chunks[i].start = end;
    end = {end.node + sizes[i].node, end.block + sizes[i].block, end.position + sizes[i].position};
    arrays_.depth = std::max(arrays_.depth, chunks[i].depth);
  }
  LOCUS_DCHECK_EQ(size_t{end.position}, triangles_.size());
  arrays_.node_count = end.node;
  arrays_.block_count = end.block;
  arrays_.triangle_count = end.position;
  arrays_.nodes = make_large_array<TriangleNode>(end.node);
  arrays_.ranges = make_large_array<NodeRange>(end.node);
  arrays_.blocks = make_large_array<TriangleBlock>(end.block);
  arrays_.numbers = make_large_array<uint32_t>(end.position);
  for_each(options_, chunks.size(), [&](size_t i) {
    if (!cancelled(options_) && chunks[i].is_subtree) write_subtree(chunks[i]);
  });
  write_top(chunks);
  return std::move(arrays_);
}

// Pushes the inner nodes, then the leaves, each in reverse order of slots. So the leaves are popped first, then the
// inner nodes, both in order of slots, and the pops are in depth-first order.
void TriangleWriter::push_children(const WideChildren<float>& children, uint32_t parent, uint32_t depth,
                                   std::vector<Pending>& pending) {
  for (const bool leaves : {false, true})
    for (uint32_t slot = children.size(); slot-- > 0;)
      if (children[slot].is_leaf() == leaves) pending.push_back({&children[slot], parent, slot, depth});
}

// Returns all chunks in depth-first order: the single nodes of the tree's top, and the subtrees below them.
std::vector<TriangleWriter::Chunk> TriangleWriter::split_into_chunks() const {
  std::vector<Chunk> chunks;
  std::vector<Pending> pending = {{&tree_.root(), 0, 0, 1}};
  while (!pending.empty()) {
    const Pending now = pending.back();
    pending.pop_back();
    const auto index = static_cast<uint32_t>(chunks.size());
    LOCUS_DCHECK(index == 0 || now.parent < index);
    const bool is_subtree = now.node->count <= kMaxSubtreeTriangles;
    chunks.push_back({now.node, is_subtree, now.parent, now.slot, now.depth, {}});
    if (is_subtree) continue;
    const WideChildren<float> children = children_by_area(*now.node);
    push_children(children, index, now.depth + 1, pending);
  }
  return chunks;
}

// Returns whether a chunk is a single block. The root of the tree always becomes a node, even if it is a leaf.
bool TriangleWriter::is_block(const Chunk& chunk) const { return chunk.root->is_leaf() && chunk.root != &tree_.root(); }

TriangleWriter::Offsets TriangleWriter::count(Chunk& chunk) const {
  if (!chunk.is_subtree) return {1, 0, 0};
  if (is_block(chunk)) return {0, 1, chunk.root->count};
  Offsets size{0, 0, chunk.root->count};
  std::vector<Pending> pending = {{chunk.root, 0, 0, chunk.depth}};
  while (!pending.empty()) {
    const Pending now = pending.back();
    pending.pop_back();
    ++size.node;
    chunk.depth = std::max(chunk.depth, now.depth);
    const WideChildren<float> children(*now.node);
    for (uint32_t slot = 0; slot < children.size(); ++slot) {
      if (children[slot].is_leaf()) {
        ++size.block;
      } else {
        pending.push_back({&children[slot], 0, 0, now.depth + 1});
      }
    }
  }
  return size;
}

// Writes the nodes of the tree's top, and stores the index of each chunk's root in the child slot of its parent.
// Chunk::start must be set in all chunks.
void TriangleWriter::write_top(const std::vector<Chunk>& chunks) {
  for (const Chunk& chunk : chunks)
    if (!chunk.is_subtree)
      write_node(children_by_area(*chunk.root), {chunk.start.position, chunk.root->count}, chunk.start.node);
  for (size_t i = 1; i < chunks.size(); ++i) {
    const Chunk& chunk = chunks[i];
    LOCUS_DCHECK(!chunks[chunk.parent].is_subtree);
    arrays_.nodes[chunks[chunk.parent].start.node].child[chunk.slot] =
        is_block(chunk) ? kBlockBit | chunk.start.block : chunk.start.node;
  }
}

// Writes all nodes and blocks of a subtree.
void TriangleWriter::write_subtree(const Chunk& chunk) {
  if (is_block(chunk)) return write_block(*chunk.root, chunk.start);
  Offsets next = chunk.start;
  std::vector<Pending> pending;
  const auto open = [&](const BinaryNode<float>& node) {
    const WideChildren<float> children = children_by_area(node);
    write_node(children, {next.position, node.count}, next.node);
    push_children(children, next.node, 0, pending);
    ++next.node;
  };
  open(*chunk.root);
  while (!pending.empty()) {
    const Pending now = pending.back();
    pending.pop_back();
    uint32_t& child = arrays_.nodes[now.parent].child[now.slot];
    if (now.node->is_leaf()) {
      child = kBlockBit | next.block;
      write_block(*now.node, next);
      ++next.block;
      next.position += now.node->count;
    } else {
      child = next.node;
      open(*now.node);
    }
  }
  LOCUS_DCHECK_EQ(next.position, chunk.start.position + chunk.root->count);
}

// Writes a node and its range. Sets all child slots to kNoChild; the used slots are set when the children are written.
void TriangleWriter::write_node(const WideChildren<float>& children, NodeRange range, uint32_t index) {
  LOCUS_DCHECK_LT(index, arrays_.node_count);
  arrays_.ranges[index] = range;
  std::array<Aabbf, kTreeWidth> boxes;
  for (uint32_t slot = 0; slot < children.size(); ++slot) boxes[slot] = children[slot].bounds;
  TriangleNode& node = arrays_.nodes[index];
  std::fill(std::begin(node.child), std::end(node.child), kNoChild);
  fill_boxes(absl::MakeConstSpan(boxes).first(children.size()), node);
}

void TriangleWriter::write_block(const BinaryNode<float>& leaf, const Offsets& offsets) {
  LOCUS_DCHECK_LT(offsets.block, arrays_.block_count);
  std::array<Triangle, kTreeWidth> triangles;
  for (uint32_t lane = 0; lane < leaf.count; ++lane) {
    triangles[lane] = triangles_[tree_.index(leaf.first + lane)];
    arrays_.numbers[offsets.position + lane] = triangles[lane].number;
  }
  fill_block(absl::MakeConstSpan(triangles).first(leaf.count), leaf.bounds, offsets.position,
             arrays_.blocks[offsets.block]);
}

}  // namespace locus
