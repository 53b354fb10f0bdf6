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

// Number of blocks or nodes that one task fills.
constexpr size_t kChunk = 4096;

// Returns INVALID_ARGUMENT with `why` as the reason.
absl::Status mismatch(absl::string_view why) {
  return absl::InvalidArgumentError(absl::StrCat("the topology does not fit the mesh: ", why));
}

// Restorer of one tree: verifies the topology, links blocks and nodes, then computes their boxes from the triangles.
class Restorer {
 public:
  Restorer(const TreeTopology& topology, uint32_t triangle_count, absl::FunctionRef<Triangle(uint32_t)> triangle,
           const BvhOptions& options)
      : topology_(topology), triangle_(triangle), options_(options) {
    arrays_.triangle_count = triangle_count;
    arrays_.block_count = static_cast<uint32_t>(topology.block_sizes.size());
    arrays_.node_count = static_cast<uint32_t>(topology.nodes.size());
  }

  absl::StatusOr<TriangleArrays> restore() {
    RETURN_IF_ERROR(check_triangle_numbers());
    make_arrays();
    RETURN_IF_ERROR(set_block_positions());
    RETURN_IF_ERROR(link_nodes());
    for_each_in_chunks(arrays_.block_count, [this](uint32_t block) { fill_block_at(block); });
    if (cancelled(options_)) return cancelled_build();
    compute_node_boxes();
    for_each_in_chunks(arrays_.node_count, [this](uint32_t node) { fill_node_at(node); });
    if (cancelled(options_)) return cancelled_build();
    return std::move(arrays_);
  }

 private:
  struct Pending {
    uint32_t parent, slot;
    uint32_t depth;
  };

  // Verifies that every triangle number occurs exactly once.
  absl::Status check_triangle_numbers() const {
    if (topology_.numbers.size() != arrays_.triangle_count) return mismatch("different number of triangles");
    if (topology_.nodes.empty() || topology_.nodes.size() > topology_.numbers.size() ||
        topology_.block_sizes.size() > topology_.numbers.size())
      return mismatch("no nodes, or more nodes or blocks than triangles");
    std::vector<bool> seen(arrays_.triangle_count);
    for (const uint32_t number : topology_.numbers) {
      if (number >= arrays_.triangle_count || seen[number])
        return mismatch("a triangle number is repeated or out of range");
      seen[number] = true;
    }
    return absl::OkStatus();
  }

  void make_arrays() {
    arrays_.nodes = make_large_array<TriangleNode>(arrays_.node_count);
    arrays_.ranges = make_large_array<NodeRange>(arrays_.node_count);
    arrays_.blocks = make_large_array<TriangleBlock>(arrays_.block_count);
    arrays_.numbers = make_large_array<uint32_t>(arrays_.triangle_count);
    std::copy(topology_.numbers.begin(), topology_.numbers.end(), arrays_.numbers.get());
    block_boxes_.resize(arrays_.block_count);
    node_boxes_.resize(arrays_.node_count);
  }

  // Sets the storage position of each block's first triangle. Verifies the block sizes.
  absl::Status set_block_positions() {
    uint64_t position = 0;
    for (uint32_t block = 0; block < arrays_.block_count; ++block) {
      const uint32_t size = topology_.block_sizes[block];
      if (size == 0 || size > kTreeWidth) return mismatch("block size out of range");
      arrays_.blocks[block].first = static_cast<uint32_t>(position);
      position += size;
    }
    if (position != arrays_.triangle_count) return mismatch("block sizes do not add up to the number of triangles");
    return absl::OkStatus();
  }

  // Sets the children of each node, and the storage position of the first triangle below the node. Verifies that the
  // nodes and blocks form one tree within the depth limit.
  absl::Status link_nodes() {
    uint32_t next_block = 0;
    std::vector<Pending> pending = {{0, 0, 1}};
    for (uint32_t index = 0; index < arrays_.node_count; ++index) {
      if (pending.empty()) return mismatch("too many nodes");
      const Pending now = pending.back();
      pending.pop_back();
      if (now.depth > limits::kMaxBvhDepth) return mismatch("too deep");
      if (index > 0) arrays_.nodes[now.parent].child[now.slot] = index;
      arrays_.depth = std::max(arrays_.depth, now.depth);
      const TopologyNode children = topology_.nodes[index];
      const uint32_t used = children.blocks | children.nodes;
      if ((children.blocks & children.nodes) != 0 || used == 0 || (used & (used + 1)) != 0)
        return mismatch("invalid children of a node");
      if (arrays_.block_count - next_block < static_cast<uint32_t>(std::popcount(children.blocks)))
        return mismatch("too few blocks");
      // If no block is left, the position set here is never used: this node has only nodes as children, and a later
      // check refuses the topology. This later check finds a node below that needs more blocks than are left, or finds
      // too few nodes.
      arrays_.ranges[index].first =
          next_block < arrays_.block_count ? arrays_.blocks[next_block].first : arrays_.triangle_count;
      TriangleNode& node = arrays_.nodes[index];
      std::fill(std::begin(node.child), std::end(node.child), kNoChild);
      for (uint32_t slot = 0; slot < kTreeWidth; ++slot)
        if ((children.blocks >> slot & 1u) != 0) node.child[slot] = kBlockBit | next_block++;
      for (uint32_t slot = kTreeWidth; slot-- > 0;)
        if ((children.nodes >> slot & 1u) != 0) pending.push_back({index, slot, now.depth + 1});
    }
    if (!pending.empty()) return mismatch("too few nodes");
    if (next_block != arrays_.block_count) return mismatch("too many blocks");
    return absl::OkStatus();
  }

  // Calls work(0) .. work(count - 1) in parallel tasks. If the build is cancelled, tasks not yet started make no calls.
  void for_each_in_chunks(uint32_t count, absl::FunctionRef<void(uint32_t)> work) const {
    for_each(options_, (count + kChunk - 1) / kChunk, [&](size_t chunk) {
      if (cancelled(options_)) return;
      const auto end = static_cast<uint32_t>(std::min<size_t>(count, (chunk + 1) * kChunk));
      for (auto i = static_cast<uint32_t>(chunk * kChunk); i < end; ++i) work(i);
    });
  }

  void fill_block_at(uint32_t index) {
    TriangleBlock& block = arrays_.blocks[index];
    const uint32_t size = topology_.block_sizes[index];
    std::array<Triangle, kTreeWidth> triangles;
    Aabbf& box = block_boxes_[index];
    for (uint32_t lane = 0; lane < size; ++lane) {
      triangles[lane] = triangle_(arrays_.numbers[block.first + lane]);
      box = merge(box, bounds_of(triangles[lane]));
    }
    LOCUS_DCHECK(is_finite(box.min) && is_finite(box.max));
    fill_block(absl::MakeConstSpan(triangles).first(size), box, block.first, block);
  }

  const Aabbf& box_of(uint32_t child) const {
    return (child & kBlockBit) != 0 ? block_boxes_[child & ~kBlockBit] : node_boxes_[child];
  }
  uint32_t count_of(uint32_t child) const {
    return (child & kBlockBit) != 0 ? arrays_.blocks[child & ~kBlockBit].count : arrays_.ranges[child].count;
  }

  // Computes the box and the number of triangles of each node, from the last node to the first, so that children, which
  // follow their parents, are computed first.
  void compute_node_boxes() {
    for (uint32_t index = arrays_.node_count; index-- > 0;) {
      uint32_t count = 0;
      for (const uint32_t child : arrays_.nodes[index].child) {
        if (child == kNoChild) break;
        LOCUS_DCHECK((child & kBlockBit) != 0 || index < child);
        node_boxes_[index] = merge(node_boxes_[index], box_of(child));
        count += count_of(child);
      }
      arrays_.ranges[index].count = count;
    }
  }

  void fill_node_at(uint32_t index) {
    TriangleNode& node = arrays_.nodes[index];
    std::array<Aabbf, kTreeWidth> boxes;
    size_t used = 0;
    for (; used < kTreeWidth && node.child[used] != kNoChild; ++used) boxes[used] = box_of(node.child[used]);
    fill_boxes(absl::MakeConstSpan(boxes).first(used), node);
  }

  const TreeTopology& topology_;
  const absl::FunctionRef<Triangle(uint32_t)> triangle_;
  const BvhOptions& options_;
  TriangleArrays arrays_;
  std::vector<Aabbf> block_boxes_, node_boxes_;
};

}  // namespace

TreeTopology topology_of(const TriangleArrays& arrays) {
  LOCUS_CHECK_LT(0u, arrays.node_count);
  TreeTopology topology;
  topology.numbers = {arrays.numbers.get(), arrays.triangle_count};
  topology.block_sizes.reserve(arrays.block_count);
  for (uint32_t block = 0; block < arrays.block_count; ++block)
    topology.block_sizes.push_back(static_cast<uint8_t>(arrays.blocks[block].count));
  topology.nodes.resize(arrays.node_count);
  for (uint32_t index = 0; index < arrays.node_count; ++index) {
    for (int slot = 0; slot < kTreeWidth; ++slot) {
      const uint32_t child = arrays.nodes[index].child[slot];
      if (child == kNoChild) continue;
      TopologyNode& node = topology.nodes[index];
      uint8_t& kind = (child & kBlockBit) != 0 ? node.blocks : node.nodes;
      LOCUS_DCHECK(slot == 0 || (node.blocks | node.nodes) >> (slot - 1) == 1);
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
