// When each query of a block asks: its as_of columns, found in the past that a snapshot keeps. Borrows from the
// snapshot and the block; any thread.
#ifndef LOCUS_CORE_QUERY_KINDS_QUERY_TIMES_H_
#define LOCUS_CORE_QUERY_KINDS_QUERY_TIMES_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/query/query_batch.h"
#include "core/scene/snapshot/scene_at_time.h"

namespace locus {

class QueryTimes {
 public:
  // OUT_OF_RANGE naming `field`.as_of_ticks, the entry and what is kept, where that is to be refused. `block` has
  // passed check_batch().
  static absl::StatusOr<QueryTimes> resolve(const SceneSnapshot& snapshot, const QueryBlock& block,
                                            const std::string& field);

  // Of query `query`.
  const SceneAtTime& of(size_t query) const { return moments_[number(query)]; }
  // The time of that moment; says nothing where the block asks about now.
  const AsOf& time(size_t query) const { return times_[number(query)]; }
  bool asks_past() const { return !times_.empty(); }
  // Whether query `query` asked about a time that is not kept.
  bool clamped(size_t query) const { return clamped_[number(query)] != 0; }

 private:
  size_t number(size_t query) const { return moments_.size() == 1 ? 0 : query; }

  std::vector<SceneAtTime> moments_;  // one a query, or one for all; the next two likewise, or empty for now
  std::vector<AsOf> times_;
  std::vector<uint8_t> clamped_;
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_QUERY_TIMES_H_
