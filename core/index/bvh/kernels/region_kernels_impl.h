// Traversal of the region kernels, compiled once for each instruction set by the .cc file that includes it. A traversal
// first opens nodes and collects items: blocks to test, and blocks and subtrees that are completely inside the region.
// Then it processes the items one by one. The two phases alternate, so that mispredicted branches of one phase do not
// delay the other. If a node is opened, its overlapping blocks immediately become items, and its overlapping child
// nodes are pushed from the last slot to the first, so that items are collected in storage order. region_ball_impl.h
// and region_box_impl.h contain the tests and their error bounds.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_REGION_KERNELS_IMPL_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_REGION_KERNELS_IMPL_H_

#include "core/index/bvh/kernels/region_ball_impl.h"
#include "core/index/bvh/kernels/region_box_impl.h"

namespace locus {
namespace {

// Flag of a node or block that is completely inside the region. Indices of nodes and blocks are less than
// kContainedBit, so they do not use this bit.
constexpr uint32_t kContainedBit = 0x40000000u;
static_assert((kContainedBit & kBlockBit) == 0 && kMinRegionRoom >= kTreeWidth);

// State of one query's traversal: the stack `waiting` of nodes (`top` elements), the collected `items` that are not
// processed yet (`end` elements), and the number of opened nodes.
template <class Query>
struct Walk {
  Query query;
  uint32_t* waiting;
  uint32_t* items;
  uint32_t top, end, nodes;

  // Returns whether a node is pending and `items` has room for its blocks.
  inline bool can_continue() const { return (top != 0) & (end <= kMaxRegionItems); }

  // Pops one element of the stack. A subtree inside the region becomes an item; any other node is opened.
  __attribute__((always_inline)) inline void step(const TriangleTree& tree) {
    const uint32_t now = waiting[--top];
    if ((now & kContainedBit) != 0) {
      items[end++] = now;
      return;
    }
    const TriangleNode& node = tree.nodes[now];
    ++nodes;
    const ChildResults children = query.test_node(node);
    const uint32_t blocks = block_slots(node) & children.overlapping, inner = children.overlapping & ~blocks;
    pack_rising(node, blocks, children.contained, kContainedBit, items + end);
    pack_falling(node, inner, children.contained, kContainedBit, waiting + top);
    end += static_cast<uint32_t>(__builtin_popcount(blocks));
    top += static_cast<uint32_t>(__builtin_popcount(inner));
  }
};

// Returns those bits of `undecided` whose triangles overlap the region according to `predicate`.
static inline uint32_t decided_exactly(const TriangleBlock& block, uint32_t undecided,
                                       const RegionPredicate& predicate) {
  uint32_t found = 0;
  for (; undecided != 0; undecided &= undecided - 1u) {
    const auto lane = static_cast<uint32_t>(__builtin_ctz(undecided));
    if (predicate.meets(predicate.region, block, lane)) found |= 1u << lane;
  }
  return found;
}

// Output buffer of triangle numbers, with the counters of the tests.
struct Sink {
  uint32_t* out;
  size_t count, room;
  NodeRange rest;  // triangles inside the region, whose numbers are still to be copied to `out`
  uint32_t tests, exact_tests;

  // Returns whether the buffer may be too small for the numbers of one more block.
  inline bool full() const { return room - count < kTreeWidth; }

  // Copies as many triangle numbers of `rest` as fit, and removes them from `rest`. Leaves seven elements of the buffer
  // free, because copy_numbers() may overwrite seven elements beyond those copied. Must not be called if full().
  inline void copy_rest(const TriangleTree& tree) {
    const size_t max_count = room - count - (kTreeWidth - 1);
    const uint32_t fits = rest.count <= max_count ? rest.count : static_cast<uint32_t>(max_count);
    copy_numbers(tree.numbers + rest.first, fits, out + count);
    count += fits;
    rest.first += fits;
    rest.count -= fits;
  }

  // Writes the numbers of those triangles of an item that overlap the region. If the item is a subtree whose numbers do
  // not all fit in the buffer, the numbers not written stay in `rest`.
  template <class Query>
  __attribute__((always_inline)) inline void process_item(const TriangleTree& tree, const Query& query,
                                                          const RegionPredicate& predicate, uint32_t item) {
    if ((item & kBlockBit) == 0) {
      rest = tree.ranges[item & ~kContainedBit];
      return copy_rest(tree);
    }
    const TriangleBlock& block = tree.blocks[item & ~(kBlockBit | kContainedBit)];
    const uint32_t found = (item & kContainedBit) != 0 ? (1u << block.count) - 1u : tested(query, predicate, block);
    pack_numbers(tree.numbers + block.first, block.count, found, out + count);
    count += static_cast<size_t>(__builtin_popcount(found));
  }

 private:
  template <class Query>
  __attribute__((always_inline)) inline uint32_t tested(const Query& query, const RegionPredicate& predicate,
                                                        const TriangleBlock& block) {
    tests += block.count;
    const TriangleResults results = query.test_block(block);
    if (__builtin_expect(results.undecided == 0, 1)) return results.certain;
    exact_tests += static_cast<uint32_t>(__builtin_popcount(results.undecided));
    return results.certain | decided_exactly(block, results.undecided, predicate);
  }
};

// Implements RegionKernel::one.
template <class Query, class Region>
static void find_one(const TriangleTree& tree, const Region& region, RegionVisit& visit) {
  Walk<Query> walk;
  walk.query.set(region);
  walk.waiting = visit.waiting;
  walk.items = visit.items;
  walk.top = visit.top;
  walk.end = visit.end;
  walk.nodes = 0;
  Sink sink = {visit.numbers, 0, visit.room, visit.rest, 0, 0};
  uint32_t next = visit.next;
  if (sink.rest.count != 0 && !sink.full()) sink.copy_rest(tree);
  while (sink.rest.count == 0 && sink.tests < kMaxRegionTests && !sink.full()) {
    if (next != walk.end) {
      sink.process_item(tree, walk.query, visit.predicate, visit.items[next++]);
      continue;
    }
    next = walk.end = 0;
    if (walk.top == 0) break;
    while (walk.can_continue()) walk.step(tree);
  }
  visit.top = walk.top;
  visit.next = next;
  visit.end = walk.end;
  visit.rest = sink.rest;
  visit.found = sink.count;
  visit.nodes = walk.nodes;
  visit.tests = sink.tests;
  visit.exact_tests = sink.exact_tests;
}

// Traversals of up to kMaxRegions queries through one tree.
template <class Query>
class Walks {
 public:
  template <class Region>
  inline Walks(const Region* regions, size_t count) : count_(static_cast<uint32_t>(count)) {
    for (uint32_t i = 0; i < count_; ++i) {
      Lane& lane = lanes_[i];
      lane.walk.query.set(regions[i]);
      lane.walk.waiting = lane.waiting;
      lane.walk.items = lane.items;
      lane.walk.top = 1;
      lane.walk.end = lane.walk.nodes = 0;
      lane.waiting[0] = 0;
    }
  }

  inline Walk<Query>& operator[](size_t i) { return lanes_[i].walk; }

  // Opens nodes of all queries in turns: while one query waits for memory or for the result of its last step, the
  // others continue. Stops for each query when can_continue() returns false: no node is pending, or its items are full.
  inline void open_all(const TriangleTree& tree) {
    uint32_t active[kMaxRegions];
    for (uint32_t i = 0; i < count_; ++i) active[i] = i;
    for (uint32_t active_count = count_; active_count != 0;) {
      uint32_t remaining = 0;
      for (uint32_t i = 0; i < active_count; ++i) {
        const uint32_t now = active[i];
        lanes_[now].walk.step(tree);
        active[remaining] = now;
        remaining += static_cast<uint32_t>(lanes_[now].walk.can_continue());
      }
      active_count = remaining;
    }
  }

 private:
  struct Lane {
    Walk<Query> walk;
    alignas(32) uint32_t waiting[kTreeStack];
    alignas(32) uint32_t items[kMaxRegionItems + kTreeWidth];
  };

  Lane lanes_[kMaxRegions];
  uint32_t count_;
};

// Completes a walk and writes the triangle numbers that it finds. Returns false if the buffer may be too small for
// these numbers.
template <class Query>
static inline bool finish(const TriangleTree& tree, const RegionPredicate& predicate, Walk<Query>& walk, Sink& sink) {
  for (;;) {
    for (uint32_t next = 0; next < walk.end; ++next) {
      if (sink.full()) return false;
      sink.process_item(tree, walk.query, predicate, walk.items[next]);
      if (sink.rest.count != 0) return false;
    }
    if (walk.top == 0) return true;
    walk.end = 0;
    while (walk.can_continue()) walk.step(tree);
  }
}

// Implements RegionKernel::many.
template <class Query, class Region>
static size_t find_many(const TriangleTree& tree, const Region* regions, const RegionPredicate* predicates,
                        size_t count, uint32_t* numbers, size_t room, uint32_t* counts) {
  Walks<Query> walks(regions, count);
  walks.open_all(tree);
  Sink sink = {numbers, 0, room, {}, 0, 0};
  for (size_t i = 0; i < count; ++i) {
    const size_t before = sink.count;
    if (!finish(tree, predicates[i], walks[i], sink)) return i;
    counts[i] = static_cast<uint32_t>(sink.count - before);
  }
  return count;
}

template <class Query, class Region>
static constexpr RegionKernel<Region> kernel_of() {
  return {find_one<Query, Region>, find_many<Query, Region>};
}

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_REGION_KERNELS_IMPL_H_
