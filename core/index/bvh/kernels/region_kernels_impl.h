// How the region kernels go through a tree, compiled once for each instruction set by the file that includes this one.
// They open nodes first and collect what they find: blocks to look into, and blocks and subtrees that are wholly
// inside. Only then do they look into it, item by item, so that neither part waits for the other's branches. Of a
// node's children the blocks stand before the nodes, which wait with the last slot lowest, so that items come in
// storage order. region_ball_impl.h and region_box_impl.h hold the tests and their error bounds.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_REGION_KERNELS_IMPL_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_REGION_KERNELS_IMPL_H_

#include "core/index/bvh/kernels/region_ball_impl.h"
#include "core/index/bvh/kernels/region_box_impl.h"

namespace locus {
namespace {

// What waits or is found is wholly inside. Numbers of nodes and blocks stay below it.
constexpr uint32_t kWholeBit = 0x40000000u;

// Where a query stands among the nodes: those that wait, and what was found and is not yet looked into.
template <class Query>
struct Walk {
  Query query;
  uint32_t* waiting;
  uint32_t* items;
  uint32_t top, end, nodes;

  inline bool goes_on() const { return (top != 0) & (end <= kMaxRegionItems); }

  // Opens the node on top.
  __attribute__((always_inline)) inline void step(const TriangleTree& tree) {
    const uint32_t now = waiting[--top];
    if ((now & kWholeBit) != 0) {
      items[end++] = now;
      return;
    }
    const TriangleNode& node = tree.nodes[now];
    ++nodes;
    const MetChildren met = query.meet_node(node);
    const uint32_t blocks = block_slots(node) & met.some, inner = met.some & ~blocks;
    pack_rising(node, blocks, met.whole, kWholeBit, items + end);
    pack_falling(node, inner, met.whole, kWholeBit, waiting + top);
    end += static_cast<uint32_t>(__builtin_popcount(blocks));
    top += static_cast<uint32_t>(__builtin_popcount(inner));
  }
};

static inline uint32_t judged(const TriangleBlock& block, uint32_t unsure, const RegionJudge& judge) {
  uint32_t found = 0;
  for (; unsure != 0; unsure &= unsure - 1u) {
    const auto place = static_cast<uint32_t>(__builtin_ctz(unsure));
    if (judge.meets(judge.region, block, place)) found |= 1u << place;
  }
  return found;
}

// Where numbers go.
struct Sink {
  uint32_t* to;
  size_t count, room;
  NodeRange rest;  // of a subtree that did not fit
  uint32_t tests, judged;

  inline bool full() const { return room - count < kTreeWidth; }

  // Copies what fits of the rest; not when full.
  inline void copy_rest(const TriangleTree& tree) {
    const size_t most = room - count - (kTreeWidth - 1);
    const uint32_t fits = rest.count <= most ? rest.count : static_cast<uint32_t>(most);
    copy_numbers(tree.numbers + rest.first, fits, to + count);
    count += fits;
    rest.first += fits;
    rest.count -= fits;
  }

  template <class Query>
  __attribute__((always_inline)) inline void look_into(const TriangleTree& tree, const Query& query,
                                                       const RegionJudge& judge, uint32_t item) {
    if ((item & kBlockBit) == 0) {
      rest = tree.ranges[item & ~kWholeBit];
      return copy_rest(tree);
    }
    const TriangleBlock& block = tree.blocks[item & ~(kBlockBit | kWholeBit)];
    const uint32_t found = (item & kWholeBit) != 0 ? (1u << block.count) - 1u : tested(query, judge, block);
    pack_numbers(tree.numbers + block.first, block.count, found, to + count);
    count += static_cast<size_t>(__builtin_popcount(found));
  }

 private:
  template <class Query>
  __attribute__((always_inline)) inline uint32_t tested(const Query& query, const RegionJudge& judge,
                                                        const TriangleBlock& block) {
    tests += block.count;
    const MetTriangles met = query.meet_block(block);
    if (__builtin_expect(met.unsure == 0, 1)) return met.sure;
    judged += static_cast<uint32_t>(__builtin_popcount(met.unsure));
    return met.sure | locus::judged(block, met.unsure, judge);
  }
};

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
      sink.look_into(tree, walk.query, visit.judge, visit.items[next++]);
      continue;
    }
    next = walk.end = 0;
    if (walk.top == 0) break;
    while (walk.goes_on()) walk.step(tree);
  }
  visit.top = walk.top;
  visit.next = next;
  visit.end = walk.end;
  visit.rest = sink.rest;
  visit.found = sink.count;
  visit.nodes = walk.nodes;
  visit.tests = sink.tests;
  visit.judged = sink.judged;
}

// The walks of several queries.
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

  // All of them in turns: while one waits for memory or for its last step's outcome, the others go on.
  inline void go_on(const TriangleTree& tree) {
    uint32_t going[kMaxRegions];
    for (uint32_t i = 0; i < count_; ++i) going[i] = i;
    for (uint32_t left = count_; left != 0;) {
      uint32_t still = 0;
      for (uint32_t i = 0; i < left; ++i) {
        const uint32_t now = going[i];
        lanes_[now].walk.step(tree);
        going[still] = now;
        still += static_cast<uint32_t>(lanes_[now].walk.goes_on());
      }
      left = still;
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

// All that a walk finds; false if there is no room for it.
template <class Query>
static inline bool finish(const TriangleTree& tree, const RegionJudge& judge, Walk<Query>& walk, Sink& sink) {
  for (;;) {
    for (uint32_t next = 0; next < walk.end; ++next) {
      if (sink.full()) return false;
      sink.look_into(tree, walk.query, judge, walk.items[next]);
      if (sink.rest.count != 0) return false;
    }
    if (walk.top == 0) return true;
    walk.end = 0;
    while (walk.goes_on()) walk.step(tree);
  }
}

template <class Query, class Region>
static size_t find_many(const TriangleTree& tree, const Region* regions, const RegionJudge* judges, size_t count,
                        uint32_t* numbers, size_t room, uint32_t* counts) {
  Walks<Query> walks(regions, count);
  walks.go_on(tree);
  Sink sink = {numbers, 0, room, {}, 0, 0};
  for (size_t i = 0; i < count; ++i) {
    const size_t before = sink.count;
    if (!finish(tree, judges[i], walks[i], sink)) return i;
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
