// What a query of some kind in some scene takes, in nanoseconds of one thread, learned from finished work. It decides
// what is small, what is large and what is too much, never what is answered.
//
// Threads: every member may be called from any thread and none takes a lock; of two that learn at once one may be lost.
// Memory is fixed: a scene that is not asked for long may be forgotten for another, and starts anew.
#ifndef LOCUS_SERVER_SCHEDULING_COST_ESTIMATES_H_
#define LOCUS_SERVER_SCHEDULING_COST_ESTIMATES_H_

#include <array>
#include <atomic>
#include <cstdint>

#include "core/query/query_batch.h"

namespace locus::server {

// What queries of similar cost have in common.
enum class CostKind : uint8_t { kRayFirst, kRayAny, kRayAll, kBall, kBox, kNearest, kLookup, kLookupGroups };
CostKind cost_kind(const QueryBlock& block);

class CostEstimates {
 public:
  static constexpr size_t kEntries = 16384;

  // Of one query of the block. `scene` is any number that stands for the scene: its epoch.
  double nanoseconds_a_query(uint64_t scene, const QueryBlock& block) const;

  // Of a whole batch.
  uint64_t nanoseconds(uint64_t scene, const QueryBatch& batch) const;

  // The block's queries took `nanoseconds` together. The more queries, the more it counts.
  void learn(uint64_t scene, const QueryBlock& block, uint64_t nanoseconds);

 private:
  struct Place {
    size_t first;
    uint32_t tag;
  };
  static Place place_of(uint64_t scene, const QueryBlock& block);
  // The entry's, or that which learning may replace.
  size_t find(const Place& place) const;

  // Tag in the upper half, nanoseconds as a float in the lower; 0 = nothing.
  std::array<std::atomic<uint64_t>, kEntries> entries_{};
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_COST_ESTIMATES_H_
