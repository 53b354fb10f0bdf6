#include "core/index/bvh/triangle_writer.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/index/bvh/triangle_parts.h"

namespace locus {

static_assert(kBvhWidth == kTreeWidth && kBvhLeafSize == kTreeWidth);

namespace {

// What lies below a node of up to so many triangles is written in one go. A constant, though nothing depends on it.
constexpr uint32_t kPieceTriangles = 8192;

WideChildren<float> children_by_area(const BinaryNode<float>& root) {
  WideChildren<float> children(root);
  children.sort_by_area();
  return children;
}

}  // namespace

TriangleArrays TriangleWriter::write() {
  std::vector<Piece> pieces = cut();
  std::vector<Place> sizes(pieces.size());
  for_each(options_, pieces.size(), [&](size_t i) { sizes[i] = count(pieces[i]); });
  Place end;
  for (size_t i = 0; i < pieces.size(); ++i) {
    pieces[i].start = end;
    end = {end.node + sizes[i].node, end.block + sizes[i].block, end.position + sizes[i].position};
    arrays_.depth = std::max(arrays_.depth, pieces[i].depth);
  }
  arrays_.node_count = end.node;
  arrays_.block_count = end.block;
  arrays_.triangle_count = end.position;
  arrays_.nodes = make_large_array<TriangleNode>(end.node);
  arrays_.ranges = make_large_array<NodeRange>(end.node);
  arrays_.blocks = make_large_array<TriangleBlock>(end.block);
  arrays_.numbers = make_large_array<uint32_t>(end.position);
  for_each(options_, pieces.size(), [&](size_t i) {
    if (!cancelled(options_) && pieces[i].whole) write_whole(pieces[i]);
  });
  write_top(pieces);
  return std::move(arrays_);
}

// Backwards, so that the first child is the next to be taken: depth-first order. Leaves are taken before nodes.
void TriangleWriter::push_children(const WideChildren<float>& children, uint32_t parent, uint32_t depth,
                                   std::vector<Waiting>& waiting) {
  for (const bool leaves : {false, true})
    for (uint32_t slot = children.size(); slot-- > 0;)
      if (children[slot].is_leaf() == leaves) waiting.push_back({&children[slot], parent, slot, depth});
}

// Depth-first: the single nodes of the top, and the pieces below them.
std::vector<TriangleWriter::Piece> TriangleWriter::cut() const {
  std::vector<Piece> pieces;
  std::vector<Waiting> waiting = {{&tree_.root(), 0, 0, 1}};
  while (!waiting.empty()) {
    const Waiting now = waiting.back();
    waiting.pop_back();
    const auto number = static_cast<uint32_t>(pieces.size());
    const bool whole = now.node->count <= kPieceTriangles;
    pieces.push_back({now.node, whole, now.parent, now.slot, now.depth, {}});
    if (whole) continue;
    const WideChildren<float> children = children_by_area(*now.node);
    push_children(children, number, now.depth + 1, waiting);
  }
  return pieces;
}

// A leaf of the top; the root of the tree is opened even where it is a leaf.
bool TriangleWriter::is_block(const Piece& piece) const { return piece.root->is_leaf() && piece.root != &tree_.root(); }

TriangleWriter::Place TriangleWriter::count(Piece& piece) const {
  if (!piece.whole) return {1, 0, 0};
  if (is_block(piece)) return {0, 1, piece.root->count};
  Place size{0, 0, piece.root->count};
  std::vector<Waiting> waiting = {{piece.root, 0, 0, piece.depth}};
  while (!waiting.empty()) {
    const Waiting now = waiting.back();
    waiting.pop_back();
    ++size.node;
    piece.depth = std::max(piece.depth, now.depth);
    const WideChildren<float> children(*now.node);
    for (uint32_t slot = 0; slot < children.size(); ++slot) {
      if (children[slot].is_leaf()) {
        ++size.block;
      } else {
        waiting.push_back({&children[slot], 0, 0, now.depth + 1});
      }
    }
  }
  return size;
}

// After the pieces below have their places.
void TriangleWriter::write_top(const std::vector<Piece>& pieces) {
  for (const Piece& piece : pieces)
    if (!piece.whole)
      write_node(children_by_area(*piece.root), {piece.start.position, piece.root->count}, piece.start.node);
  for (size_t i = 1; i < pieces.size(); ++i) {
    const Piece& piece = pieces[i];
    arrays_.nodes[pieces[piece.parent].start.node].child[piece.slot] =
        is_block(piece) ? kBlockBit | piece.start.block : piece.start.node;
  }
}

void TriangleWriter::write_whole(const Piece& piece) {
  if (is_block(piece)) return write_block(*piece.root, piece.start);
  Place next = piece.start;
  std::vector<Waiting> waiting;
  const auto open = [&](const BinaryNode<float>& node) {
    const WideChildren<float> children = children_by_area(node);
    write_node(children, {next.position, node.count}, next.node);
    push_children(children, next.node, 0, waiting);
    ++next.node;
  };
  open(*piece.root);
  while (!waiting.empty()) {
    const Waiting now = waiting.back();
    waiting.pop_back();
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
}

// All but the numbers of its children.
void TriangleWriter::write_node(const WideChildren<float>& children, NodeRange range, uint32_t number) {
  arrays_.ranges[number] = range;
  std::array<Aabbf, kTreeWidth> boxes;
  for (uint32_t slot = 0; slot < children.size(); ++slot) boxes[slot] = children[slot].bounds;
  TriangleNode& node = arrays_.nodes[number];
  std::fill(std::begin(node.child), std::end(node.child), kNoChild);
  fill_boxes(absl::MakeConstSpan(boxes).first(children.size()), node);
}

void TriangleWriter::write_block(const BinaryNode<float>& leaf, const Place& place) {
  std::array<Triangle, kTreeWidth> triangles;
  for (uint32_t lane = 0; lane < leaf.count; ++lane) {
    triangles[lane] = triangles_[tree_.index(leaf.first + lane)];
    arrays_.numbers[place.position + lane] = triangles[lane].number;
  }
  fill_block(absl::MakeConstSpan(triangles).first(leaf.count), leaf.bounds, place.position,
             arrays_.blocks[place.block]);
}

}  // namespace locus
