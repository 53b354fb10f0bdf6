#include "core/index/bvh/tree_topology.h"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/base/status_macros.h"
#include "core/index/bvh/triangle_parts.h"

namespace locus {
namespace {

// Blocks or nodes that one thread fills at once.
constexpr size_t kPiece = 4096;

absl::Status no_outline(absl::string_view why) {
  return absl::InvalidArgumentError(absl::StrCat("the outline of the tree does not fit: ", why));
}

class Restorer {
 public:
  Restorer(const TreeTopology& topology, uint32_t triangle_count, absl::FunctionRef<Triangle(uint32_t)> triangle,
           const BvhOptions& options)
      : outline_(topology), triangle_(triangle), options_(options) {
    arrays_.triangle_count = triangle_count;
    arrays_.block_count = static_cast<uint32_t>(topology.block_sizes.size());
    arrays_.node_count = static_cast<uint32_t>(topology.nodes.size());
  }

  absl::StatusOr<TriangleArrays> restore() {
    RETURN_IF_ERROR(check_numbers());
    make_arrays();
    RETURN_IF_ERROR(place_blocks());
    RETURN_IF_ERROR(place_nodes());
    in_pieces(arrays_.block_count, [this](uint32_t block) { fill(block); });
    if (cancelled(options_)) return cancelled_build();
    enclose();
    in_pieces(arrays_.node_count, [this](uint32_t node) { fill_node(node); });
    if (cancelled(options_)) return cancelled_build();
    return std::move(arrays_);
  }

 private:
  struct Waiting {
    uint32_t parent, slot;
    uint32_t depth;
  };

  // That every triangle is there, once.
  absl::Status check_numbers() const {
    if (outline_.numbers.size() != arrays_.triangle_count) return no_outline("other triangles");
    if (outline_.nodes.empty() || outline_.nodes.size() > outline_.numbers.size() ||
        outline_.block_sizes.size() > outline_.numbers.size())
      return no_outline("nodes or blocks without triangles");
    std::vector<bool> seen(arrays_.triangle_count);
    for (const uint32_t number : outline_.numbers) {
      if (number >= arrays_.triangle_count || seen[number]) return no_outline("a triangle is missing");
      seen[number] = true;
    }
    return absl::OkStatus();
  }

  void make_arrays() {
    arrays_.nodes = make_large_array<TriangleNode>(arrays_.node_count);
    arrays_.ranges = make_large_array<NodeRange>(arrays_.node_count);
    arrays_.blocks = make_large_array<TriangleBlock>(arrays_.block_count);
    arrays_.numbers = make_large_array<uint32_t>(arrays_.triangle_count);
    std::copy(outline_.numbers.begin(), outline_.numbers.end(), arrays_.numbers.get());
    block_boxes_.resize(arrays_.block_count);
    node_boxes_.resize(arrays_.node_count);
  }

  // Which triangles each block has.
  absl::Status place_blocks() {
    uint64_t position = 0;
    for (uint32_t block = 0; block < arrays_.block_count; ++block) {
      const uint32_t size = outline_.block_sizes[block];
      if (size == 0 || size > kTreeWidth) return no_outline("the size of a block");
      arrays_.blocks[block].first = static_cast<uint32_t>(position);
      position += size;
    }
    if (position != arrays_.triangle_count) return no_outline("blocks of other triangles");
    return absl::OkStatus();
  }

  // Which children each node has, and with which triangle it begins.
  absl::Status place_nodes() {
    uint32_t next_block = 0;
    std::vector<Waiting> waiting = {{0, 0, 1}};
    for (uint32_t number = 0; number < arrays_.node_count; ++number) {
      if (waiting.empty()) return no_outline("nodes too many");
      const Waiting now = waiting.back();
      waiting.pop_back();
      if (now.depth > limits::kMaxBvhDepth) return no_outline("too deep");
      if (number > 0) arrays_.nodes[now.parent].child[now.slot] = number;
      arrays_.depth = std::max(arrays_.depth, now.depth);
      const NodeOutline children = outline_.nodes[number];
      const uint32_t used = children.blocks | children.nodes;
      if ((children.blocks & children.nodes) != 0 || used == 0 || (used & (used + 1)) != 0)
        return no_outline("the children of a node");
      if (arrays_.block_count - next_block < static_cast<uint32_t>(std::popcount(children.blocks)))
        return no_outline("blocks are missing");
      // Where there is no block left for what is below, the walk fails there.
      arrays_.ranges[number].first =
          next_block < arrays_.block_count ? arrays_.blocks[next_block].first : arrays_.triangle_count;
      TriangleNode& node = arrays_.nodes[number];
      std::fill(std::begin(node.child), std::end(node.child), kNoChild);
      for (uint32_t slot = 0; slot < kTreeWidth; ++slot)
        if ((children.blocks >> slot & 1u) != 0) node.child[slot] = kBlockBit | next_block++;
      for (uint32_t slot = kTreeWidth; slot-- > 0;)
        if ((children.nodes >> slot & 1u) != 0) waiting.push_back({number, slot, now.depth + 1});
    }
    if (!waiting.empty()) return no_outline("nodes are missing");
    if (next_block != arrays_.block_count) return no_outline("blocks too many");
    return absl::OkStatus();
  }

  void in_pieces(uint32_t count, absl::FunctionRef<void(uint32_t)> work) const {
    for_each(options_, (count + kPiece - 1) / kPiece, [&](size_t piece) {
      if (cancelled(options_)) return;
      const auto end = static_cast<uint32_t>(std::min<size_t>(count, (piece + 1) * kPiece));
      for (auto i = static_cast<uint32_t>(piece * kPiece); i < end; ++i) work(i);
    });
  }

  void fill(uint32_t number) {
    TriangleBlock& block = arrays_.blocks[number];
    const uint32_t size = outline_.block_sizes[number];
    std::array<Triangle, kTreeWidth> triangles;
    Aabbf& box = block_boxes_[number];
    for (uint32_t place = 0; place < size; ++place) {
      triangles[place] = triangle_(arrays_.numbers[block.first + place]);
      box = merge(box, bounds_of(triangles[place]));
    }
    fill_block(absl::MakeConstSpan(triangles).first(size), box, block.first, block);
  }

  const Aabbf& box_of(uint32_t child) const {
    return (child & kBlockBit) != 0 ? block_boxes_[child & ~kBlockBit] : node_boxes_[child];
  }
  uint32_t count_of(uint32_t child) const {
    return (child & kBlockBit) != 0 ? arrays_.blocks[child & ~kBlockBit].count : arrays_.ranges[child].count;
  }

  // The boxes and sizes of all nodes, from the last on: children come behind their parents.
  void enclose() {
    for (uint32_t number = arrays_.node_count; number-- > 0;) {
      uint32_t count = 0;
      for (const uint32_t child : arrays_.nodes[number].child) {
        if (child == kNoChild) break;
        node_boxes_[number] = merge(node_boxes_[number], box_of(child));
        count += count_of(child);
      }
      arrays_.ranges[number].count = count;
    }
  }

  void fill_node(uint32_t number) {
    TriangleNode& node = arrays_.nodes[number];
    std::array<Aabbf, kTreeWidth> boxes;
    size_t used = 0;
    for (; used < kTreeWidth && node.child[used] != kNoChild; ++used) boxes[used] = box_of(node.child[used]);
    fill_boxes(absl::MakeConstSpan(boxes).first(used), node);
  }

  const TreeTopology& outline_;
  const absl::FunctionRef<Triangle(uint32_t)> triangle_;
  const BvhOptions& options_;
  TriangleArrays arrays_;
  std::vector<Aabbf> block_boxes_, node_boxes_;
};

}  // namespace

TreeTopology outline_of(const TriangleArrays& arrays) {
  LOCUS_CHECK_LT(0u, arrays.node_count);
  TreeTopology topology;
  topology.numbers = {arrays.numbers.get(), arrays.triangle_count};
  topology.block_sizes.reserve(arrays.block_count);
  for (uint32_t block = 0; block < arrays.block_count; ++block)
    topology.block_sizes.push_back(static_cast<uint8_t>(arrays.blocks[block].count));
  topology.nodes.resize(arrays.node_count);
  for (uint32_t number = 0; number < arrays.node_count; ++number) {
    for (int slot = 0; slot < kTreeWidth; ++slot) {
      const uint32_t child = arrays.nodes[number].child[slot];
      if (child == kNoChild) continue;
      NodeOutline& node = topology.nodes[number];
      uint8_t& kind = (child & kBlockBit) != 0 ? node.blocks : node.nodes;
      kind = static_cast<uint8_t>(kind | 1u << slot);
    }
  }
  return topology;
}

absl::StatusOr<TriangleArrays> restore_arrays(const TreeTopology& topology, uint32_t triangle_count,
                                              absl::FunctionRef<Triangle(uint32_t)> triangle,
                                              const BvhOptions& options) {
  return Restorer(topology, triangle_count, triangle, options).restore();
}

}  // namespace locus
