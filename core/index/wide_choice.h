// Choice of how a binary node is collapsed into nodes of up to eight children at minimum cost. A wide node has eight
// child slots. For each number of slots that the binary node may occupy in a wide node, the choice tells whether the
// binary node becomes a wide node of its own or is opened. If it is opened, its two children share the slots, and the
// choice contains the number of slots of the left child. Choices are computed from the leaves upwards by dynamic
// programming. The cost of a wide node is its area plus a small constant, which keeps the number of nodes low.
// Immutable. Invariants: the cost never increases with the number of slots; each child of an opened node gets at least
// one slot. Source: Ylitie, Karras, Laine, Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs,
// 2017.
#ifndef LOCUS_CORE_INDEX_WIDE_CHOICE_H_
#define LOCUS_CORE_INDEX_WIDE_CHOICE_H_

#include <array>
#include <cstdint>

#include "core/base/check.h"
#include "core/index/tree_build.h"

namespace locus {

class WideChoice {
 public:
  // Makes the choice of a leaf. A leaf costs 0 for any number of slots.
  WideChoice() = default;

  // Makes the choice of an inner node from the choices of its children. `cost` is the cost of the wide node that the
  // inner node can become, without the costs of that wide node's children.
  WideChoice(const WideChoice& left, const WideChoice& right, float cost) {
    std::array<float, kBvhWidth + 1> opened{};
    for (uint32_t slots = 2; slots <= kBvhWidth; ++slots) opened[slots] = best_share(left, right, slots);
    costs_[1] = cost + opened[kBvhWidth];
    for (uint32_t slots = 2; slots < kBvhWidth; ++slots) {
      const bool open = opened[slots] <= costs_[1];
      costs_[slots] = open ? opened[slots] : costs_[1];
      if (!open) left_slots_[slots] = 0;
    }
    LOCUS_DCHECK_CALL(check_invariants());
  }

  // Returns how many of `slots` slots (two to eight) an inner node assigns to its left child. Returns 0 if the inner
  // node becomes a wide node of its own. With eight slots the inner node is always opened.
  uint32_t left_slots(uint32_t slots) const {
    LOCUS_DCHECK(2 <= slots && slots <= kBvhWidth);
    return left_slots_[slots];
  }

 private:
  // Verifies, in debug builds, that the cost never increases with the number of slots that the binary node may occupy,
  // and that the node is opened if it may occupy all eight slots.
  void check_invariants() const {
    for (uint32_t slots = 2; slots < kBvhWidth; ++slots) LOCUS_DCHECK_LE(costs_[slots], costs_[slots - 1]);
    for (uint32_t slots = 2; slots <= kBvhWidth; ++slots) LOCUS_DCHECK_LT(uint32_t{left_slots_[slots]}, slots);
    LOCUS_DCHECK_LT(0u, uint32_t{left_slots_[kBvhWidth]});
  }

  // Returns the minimum cost of sharing `slots` slots between the children, and stores the left child's number of slots
  // in left_slots_. The even division is tried first and wins if costs are equal.
  float best_share(const WideChoice& left, const WideChoice& right, uint32_t slots) {
    uint32_t best = slots / 2;
    float min_cost = left.costs_[best] + right.costs_[slots - best];
    for (uint32_t k = 1; k < slots; ++k) {
      const float cost = left.costs_[k] + right.costs_[slots - k];
      if (cost < min_cost) {
        min_cost = cost;
        best = k;
      }
    }
    left_slots_[slots] = static_cast<uint8_t>(best);
    return min_cost;
  }

  std::array<float, kBvhWidth> costs_{};  // minimum cost for each number of slots, 1 to 7
  std::array<uint8_t, kBvhWidth + 1> left_slots_{};
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_WIDE_CHOICE_H_
