// How a binary tree collapses to nodes of eight children at the least cost: for each binary node and each number of
// child slots it may be given, whether to open it and how its two children share them. Found from the leaves up by
// dynamic programming. What counts is the area of nodes, and a little for each node, so that there are few of them.
// Plain data. Source: Ylitie, Karras, Laine, Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs,
// 2017.
#ifndef LOCUS_CORE_INDEX_BVH_WIDE_CHOICE_H_
#define LOCUS_CORE_INDEX_BVH_WIDE_CHOICE_H_

#include <array>
#include <cstdint>

#include "core/index/bvh/bvh_node.h"

namespace locus {

class WideChoice {
 public:
  // Of a leaf: costs nothing in any number of slots.
  WideChoice() = default;

  // Of an inner node whose own wide node would cost `cost`.
  WideChoice(const WideChoice& left, const WideChoice& right, float cost) {
    std::array<float, kBvhWidth + 1> opened{};
    for (uint32_t slots = 2; slots <= kBvhWidth; ++slots) opened[slots] = share(left, right, slots);
    costs_[1] = cost + opened[kBvhWidth];
    for (uint32_t slots = 2; slots < kBvhWidth; ++slots) {
      const bool open = opened[slots] <= costs_[1];
      costs_[slots] = open ? opened[slots] : costs_[1];
      if (!open) left_slots_[slots] = 0;
    }
  }

  // Of an inner node with `slots` slots, two to eight: how many go to its left child; 0 where it stays one child. It
  // always opens into eight.
  uint32_t left_slots(uint32_t slots) const { return left_slots_[slots]; }

 private:
  // From the middle outwards, so that equal costs share evenly.
  float share(const WideChoice& left, const WideChoice& right, uint32_t slots) {
    uint32_t best = slots / 2;
    float least = left.costs_[best] + right.costs_[slots - best];
    for (uint32_t k = 1; k < slots; ++k) {
      const float cost = left.costs_[k] + right.costs_[slots - k];
      if (cost < least) {
        least = cost;
        best = k;
      }
    }
    left_slots_[slots] = static_cast<uint8_t>(best);
    return least;
  }

  std::array<float, kBvhWidth> costs_{};  // by slots, from 1
  std::array<uint8_t, kBvhWidth + 1> left_slots_{};
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_WIDE_CHOICE_H_
