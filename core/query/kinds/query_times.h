// Effective times of the queries of a block: the times at which the queries are evaluated. The times result from the
// block's as_of columns and the history that the snapshot retains. Immutable, so any thread may use it; borrows from
// the snapshot.
#ifndef LOCUS_CORE_QUERY_KINDS_QUERY_TIMES_H_
#define LOCUS_CORE_QUERY_KINDS_QUERY_TIMES_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/check.h"
#include "core/query/query_batch.h"
#include "core/scene/snapshot/scene_at_time.h"

namespace locus {

// Invariant: scenes_ has one entry per query, or one entry for all queries; times_ and clamped_ have the same number of
// entries as scenes_, or no entries if the block has no as_of_ticks.
class QueryTimes {
 public:
  // Resolves the times of `block`, which has passed check_batch(). `field` is the block's name in errors. Returns
  // OUT_OF_RANGE for a time outside the history unless the block has OutsideHistory::kClamp; the error names
  // `field`.as_of_ticks, the index of the entry and the retained ticks. Takes from `budget` the memory of the
  // sets of interpolated instances that the queries may make; returns INVALID_ARGUMENT if it is not enough.
  static absl::StatusOr<QueryTimes> resolve(const SceneSnapshot& snapshot, const QueryBlock& block,
                                            const std::string& field, InterpolationBudget& budget);

  // Returns the objects and instances at the effective time of a query.
  const SceneAtTime& of(size_t query) const { return scenes_[entry_of(query)]; }
  // Returns the effective time of a query. Precondition: asks_past().
  const AsOf& time(size_t query) const {
    LOCUS_DCHECK(asks_past());
    return times_[entry_of(query)];
  }
  // Returns whether the block has queries and as_of_ticks. If not, all queries see the snapshot's latest state.
  bool asks_past() const { return !times_.empty(); }
  // Returns whether a query requested a time outside the history. Precondition: asks_past().
  bool clamped(size_t query) const {
    LOCUS_DCHECK(asks_past());
    return clamped_[entry_of(query)] != 0;
  }

 private:
  void check_invariants(size_t queries) const {
    LOCUS_DCHECK(scenes_.size() == 1 || scenes_.size() == queries);
    LOCUS_DCHECK(times_.empty() || times_.size() == scenes_.size());
    LOCUS_DCHECK_EQ(clamped_.size(), times_.size());
  }
  size_t entry_of(size_t query) const {
    LOCUS_DCHECK(scenes_.size() == 1 || query < scenes_.size());
    return scenes_.size() == 1 ? 0 : query;
  }

  std::vector<SceneAtTime> scenes_;
  std::vector<AsOf> times_;
  std::vector<uint8_t> clamped_;
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_QUERY_TIMES_H_
