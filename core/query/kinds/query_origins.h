// Points to which the positions of a block's queries are relative: the frame of the block or, with anchor_ids, the
// position of each query's anchor at the query's time. Immutable, so any thread may use it; borrows the block.
#ifndef LOCUS_CORE_QUERY_KINDS_QUERY_ORIGINS_H_
#define LOCUS_CORE_QUERY_KINDS_QUERY_ORIGINS_H_

#include <vector>

#include "core/base/check.h"
#include "core/query/kinds/query_times.h"
#include "core/query/query_batch.h"

namespace locus {

// Invariant: positions_ has one entry for each query of a block with anchor_ids, one entry if all queries have the same
// anchor at the same time, and no entry without anchor_ids; unanchored_ ascends.
class QueryOrigins {
 public:
  // Looks up the anchors of `block`, which has passed check_batch(), at the times of its queries. O(1) for each query.
  QueryOrigins(const QueryBlock& block, const QueryTimes& times);

  // Returns the point to which the positions of query `i` are relative. The point has no meaning if the query is
  // unanchored.
  Vec3d of(size_t i) const {
    LOCUS_DCHECK(positions_.size() <= 1 || i < positions_.size());
    return positions_.empty() ? block_.frame : positions_[positions_.size() == 1 ? 0 : i];
  }
  // Returns whether query `i` has no answer, because its anchor does not exist at the query's time, or because one of
  // its positions would lie outside the world.
  bool is_unanchored(size_t i) const;
  // Returns the indices of unanchored queries, ascending.
  const std::vector<uint32_t>& unanchored() const { return unanchored_; }

 private:
  const QueryBlock& block_;
  std::vector<Vec3d> positions_;
  std::vector<uint32_t> unanchored_;
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_QUERY_ORIGINS_H_
