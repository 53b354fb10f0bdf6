// Random tree topologies for a given number of triangles: the triangles of a block and the blocks of a node are chosen
// at random. No builder makes such a topology, but it fits the mesh, so a data directory could contain it.
#ifndef LOCUS_TESTS_SUPPORT_RANDOM_TOPOLOGY_H_
#define LOCUS_TESTS_SUPPORT_RANDOM_TOPOLOGY_H_

#include <algorithm>
#include <numeric>
#include <vector>

#include "core/index/bvh/tree_topology.h"
#include "tests/support/random.h"

namespace locus::test {

class RandomTopology {
 public:
  // Makes a random topology of `triangles` triangles, at least one.
  RandomTopology(uint32_t triangles, Random& random) : numbers_(triangles) {
    std::iota(numbers_.begin(), numbers_.end(), 0);
    random.shuffle(numbers_);
    for (uint32_t left = triangles; left > 0; left -= topology_.block_sizes.back())
      topology_.block_sizes.push_back(static_cast<uint8_t>(1 + random.below(std::min<uint32_t>(left, kTreeWidth))));
    topology_.numbers = numbers_;
    add_node(static_cast<uint32_t>(topology_.block_sizes.size()), random);
  }
  RandomTopology(const RandomTopology&) = delete;
  RandomTopology& operator=(const RandomTopology&) = delete;

  const TreeTopology& topology() const { return topology_; }

 private:
  // Adds a node and its subtree, which contains `blocks` blocks in total. At most half of the blocks are below one
  // child, so that the tree stays shallow.
  void add_node(uint32_t blocks, Random& random) {
    const uint32_t most = std::min<uint32_t>(blocks, kTreeWidth);
    const uint32_t children = blocks == 1 ? 1 : 2 + static_cast<uint32_t>(random.below(most - 1));
    std::vector<uint32_t> shares(children, 1);
    const uint32_t largest = blocks <= children ? 1 : (blocks + 1) / 2;
    for (uint32_t left = blocks - children; left > 0;) {
      uint32_t& share = shares[random.below(children)];
      const uint32_t more = std::min(left, largest - std::min(largest, share));
      const uint32_t taken = more == 0 ? 0 : 1 + static_cast<uint32_t>(random.below(more));
      share += taken;
      left -= taken;
    }
    const size_t number = topology_.nodes.size();
    topology_.nodes.emplace_back();
    std::vector<uint32_t> below;
    for (uint32_t slot = 0; slot < children; ++slot) {
      // A node of a single block is valid, too.
      const bool is_block = shares[slot] == 1 && (blocks == 1 || random.chance(0.9));
      TopologyNode& node = topology_.nodes[number];
      uint8_t& kind = is_block ? node.blocks : node.nodes;
      kind = static_cast<uint8_t>(kind | 1u << slot);
      if (!is_block) below.push_back(shares[slot]);
    }
    for (const uint32_t share : below) add_node(share, random);
  }

  std::vector<uint32_t> numbers_;
  TreeTopology topology_;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_RANDOM_TOPOLOGY_H_
