// The visit of a tree by the region kernels, compiled once for each instruction set by the file that includes this one.
// Children wait with the last slot lowest, so that triangles come in storage order. region_ball_impl.h and
// region_box_impl.h hold the tests and their error bounds.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_REGION_KERNELS_IMPL_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_REGION_KERNELS_IMPL_H_

#include "core/index/bvh/kernels/region_ball_impl.h"
#include "core/index/bvh/kernels/region_box_impl.h"

namespace locus {
namespace {

// What waits is wholly inside. Numbers of nodes and blocks stay below it.
constexpr uint32_t kWholeBit = 0x40000000u;

static inline NodeRange range_of(const TriangleTree& tree, uint32_t child) {
  if ((child & kBlockBit) == 0) return tree.ranges[child & ~kWholeBit];
  const TriangleBlock& block = tree.blocks[child & ~(kBlockBit | kWholeBit)];
  return {block.first, block.count};
}

static inline uint32_t judged(const TriangleBlock& block, uint32_t unsure, const RegionJudge& judge) {
  uint32_t found = 0;
  for (; unsure != 0; unsure &= unsure - 1u) {
    const auto place = static_cast<uint32_t>(__builtin_ctz(unsure));
    if (judge.meets(judge.region, block, place)) found |= 1u << place;
  }
  return found;
}

// A visit on its way, its numbers out of reach of what is written to `waiting`.
template <class Query>
struct Walker {
  Query query;
  RegionVisit* visit;
  uint32_t* waiting;
  uint32_t top, nodes, tests, judged;
  NodeRange rest;
  uint32_t* to;
  size_t count, room;

  template <class Region>
  inline void start(const Region& region, RegionVisit& from) {
    query.set(region);
    visit = &from;
    waiting = from.waiting;
    top = from.top;
    rest = from.rest;
    to = from.numbers;
    room = from.room;
    count = 0;
    nodes = tests = judged = 0;
  }
  inline void leave() const {
    visit->top = top;
    visit->rest = rest;
    visit->found = count;
    visit->nodes = nodes;
    visit->tests = tests;
    visit->judged = judged;
  }

  inline bool full() const { return room - count < kTreeWidth; }
  inline bool pauses() const { return top == 0 || rest.count != 0 || tests >= kMaxRegionTests || full(); }

  // Copies what fits of the rest.
  inline void copy_rest(const TriangleTree& tree) {
    const size_t most = room - count - (kTreeWidth - 1);
    const uint32_t fits = rest.count <= most ? rest.count : static_cast<uint32_t>(most);
    copy_numbers(tree.numbers + rest.first, fits, to + count);
    count += fits;
    rest.first += fits;
    rest.count -= fits;
  }

  // Takes what waits on top.
  __attribute__((always_inline)) inline void step(const TriangleTree& tree) {
    const uint32_t now = waiting[--top];
    if ((now & kWholeBit) != 0) {
      rest = range_of(tree, now);
      copy_rest(tree);
    } else if ((now & kBlockBit) != 0) {
      look_into(tree, tree.blocks[now & ~kBlockBit]);
    } else {
      open(tree.nodes[now]);
    }
  }

  // Asks for the memory of the next step.
  inline void prefetch_next(const TriangleTree& tree) const {
    const uint32_t next = waiting[top - 1];
    if ((next & kBlockBit) != 0)
      prefetch(&tree.blocks[next & ~(kBlockBit | kWholeBit)], sizeof(TriangleBlock));
    else if ((next & kWholeBit) != 0)
      prefetch(&tree.ranges[next & ~kWholeBit], sizeof(NodeRange));
    else
      prefetch(&tree.nodes[next], sizeof(TriangleNode));
  }

 private:
  __attribute__((always_inline)) inline void open(const TriangleNode& node) {
    ++nodes;
    const MetChildren met = query.meet_node(node);
    pack_falling(node, met.some, met.whole, kWholeBit, waiting + top);
    top += static_cast<uint32_t>(__builtin_popcount(met.some));
  }

  __attribute__((always_inline)) inline void look_into(const TriangleTree& tree, const TriangleBlock& block) {
    tests += block.count;
    const MetTriangles met = query.meet_block(block);
    uint32_t found = met.sure;
    if (met.unsure != 0) {
      judged += static_cast<uint32_t>(__builtin_popcount(met.unsure));
      found |= locus::judged(block, met.unsure, visit->judge);
    }
    pack_numbers(tree.numbers + block.first, block.count, found, to + count);
    count += static_cast<size_t>(__builtin_popcount(found));
  }
};

template <class Query, class Region>
static inline void find_one(const TriangleTree& tree, const Region& region, RegionVisit& visit) {
  Walker<Query> walker;
  walker.start(region, visit);
  if (walker.rest.count != 0 && !walker.full()) walker.copy_rest(tree);
  while (!walker.pauses()) walker.step(tree);
  walker.leave();
}

// Several visits in turns: while one waits for memory, the others go on.
template <class Query, class Region>
static void find(const TriangleTree& tree, const Region* regions, RegionVisit* visits, size_t count) {
  if (count == 1) return find_one<Query>(tree, regions[0], visits[0]);
  Walker<Query> walkers[kMaxRegionVisits];
  uint32_t going[kMaxRegionVisits];
  uint32_t left = 0;
  for (uint32_t i = 0; i < count; ++i) {
    walkers[i].start(regions[i], visits[i]);
    if (walkers[i].rest.count != 0 && !walkers[i].full()) walkers[i].copy_rest(tree);
    going[left++] = i;
  }
  while (left != 0) {
    for (uint32_t turn = 0; turn < left;) {
      Walker<Query>& walker = walkers[going[turn]];
      if (!walker.pauses()) walker.step(tree);
      if (walker.pauses()) {
        walker.leave();
        going[turn] = going[--left];
        continue;
      }
      walker.prefetch_next(tree);
      ++turn;
    }
  }
}

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_REGION_KERNELS_IMPL_H_
