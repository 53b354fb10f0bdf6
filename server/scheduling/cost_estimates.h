// Estimated cost of a query by scene, kind and QueryBlock::source, in nanoseconds of one thread, learned from finished
// work. Estimates decide where and when a batch runs and whether it is admitted; they never change an answer.
//
// Queries by list, which test every value of the scene, have estimates of their own: nanoseconds of one test. So an
// estimate still holds after the scene has grown.
//
// Threads: every member may be called from any thread, and no member takes a lock. If two threads call learn() at the
// same time, one of their measurements may be lost. Memory is fixed: a new estimate may overwrite the entry of another
// estimate, which then has its default value until learn() is called for it again.
#ifndef LOCUS_SERVER_SCHEDULING_COST_ESTIMATES_H_
#define LOCUS_SERVER_SCHEDULING_COST_ESTIMATES_H_

#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

#include "absl/strings/string_view.h"
#include "core/query/query_batch.h"

namespace locus::server {

// Kinds of queries with similar cost.
enum class CostKind : uint8_t {
  kRayFirst,
  kRayAny,
  kRayAll,
  kBall,
  kBox,
  kNearest,
  kLookup,
  kLookupGroups,
  kCapsule,
  kSweep,
  kFrustum,
  kSight,
  kContains,
  kPairs,
  kCell
};
CostKind cost_kind(const QueryBlock& block);
// Returns the kind's name in LearnedCost.kind of the protocol, such as "rays_first".
absl::string_view cost_kind_name(CostKind kind);

// Estimates of one kind of query, for one query.
struct KindCost {
  CostKind kind;
  Source source;
  bool by_list;
  double nanoseconds;
  double work;  // sum of nodes, cells and tests
};

class CostEstimates {
 public:
  static constexpr size_t kEntries = 16384;

  // Number of values that each query tests; 0: the query searches the structures.
  using ListValues = uint64_t;

  // Returns the estimate for one query of the block; for sight, for one segment from an eye to a sample. `scene` is any
  // number that identifies the scene, such as its epoch.
  double nanoseconds_a_query(uint64_t scene, const QueryBlock& block, ListValues values = 0) const;

  // Returns the estimate for a whole batch.
  uint64_t nanoseconds(uint64_t scene, const QueryBatch& batch, ListValues values = 0) const;

  // Updates the estimate from a measurement: all queries of the block took `nanoseconds` and `work` together. The
  // weight of the measurement grows with the number of queries.
  void learn(uint64_t scene, const QueryBlock& block, uint64_t nanoseconds, ListValues values = 0, uint64_t work = 0);

  // Returns the estimates of a scene that were learned, ascending by name of the kind, source and by_list. `values` is
  // the number of values that a query by list tests.
  std::vector<KindCost> learned(uint64_t scene, ListValues values) const;

 private:
  // Position of an estimate in the hash table: the first entry to search, and the tag that marks the estimate.
  struct Slot {
    size_t first;
    uint32_t tag;
  };
  static Slot slot_of(uint64_t scene, CostKind kind, Source source, bool by_list);
  static Slot slot_of(uint64_t scene, const QueryBlock& block, bool by_list) {
    return slot_of(scene, cost_kind(block), block.source, by_list);
  }
  // Returns the index of the slot's entry. If the slot has no entry, returns the index of the entry that learn() may
  // replace; the caller recognizes this case because the entry has another tag than the slot.
  size_t find(const Slot& slot) const;

  // Entries of a hash table: a tag in the upper 32 bits, nanoseconds as a float in the lower 32 bits; 0: no entry.
  std::array<std::atomic<uint64_t>, kEntries> entries_{};
  // At the same indices: the same tag, and the work of a query. Read only for descriptions of scenes.
  std::array<std::atomic<uint64_t>, kEntries> works_{};
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_COST_ESTIMATES_H_
