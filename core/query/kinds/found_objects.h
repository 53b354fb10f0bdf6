// Objects that one ball or box query found: the lowest by id, at most a given number, in order. A QueryTask reuses one
// for all queries of a chunk, so that its memory is allocated once. Threads: one thread.
#ifndef LOCUS_CORE_QUERY_KINDS_FOUND_OBJECTS_H_
#define LOCUS_CORE_QUERY_KINDS_FOUND_OBJECTS_H_

#include <vector>

#include "absl/types/span.h"
#include "core/base/check.h"
#include "core/base/ids.h"
#include "core/index/hash_grid/brick_scan.h"

namespace locus {

struct FoundObject {
  Id id = kNoId;
  GridRef object;
};

// Invariant: at most 2 * max_count_ objects are collected between calls. Memory: three times max_count_ at most.
class FoundObjects {
 public:
  // Clears the collection for the next query, which keeps at most `max_count` objects.
  void restart(size_t max_count);

  // Adds an object. Precondition: no object with its id was added since restart().
  void offer(const GridRef& object) {
    LOCUS_DCHECK_NE(object.entry().id, kNoId);
    found_.push_back({object.entry().id, object});
    if (found_.size() > 2 * max_count_) keep_lowest();
    check_invariants();
  }
  // Returns the kept objects, ascending by id. Valid until the next call of restart() or offer().
  absl::Span<const FoundObject> finish();
  // Returns whether more objects were added than are kept. Valid after finish().
  bool truncated() const { return truncated_; }

 private:
  void check_invariants() const { LOCUS_DCHECK_LE(found_.size(), 2 * max_count_); }
  // Drops all but the max_count_ lowest.
  void keep_lowest();
  void sort();
  // Orders the objects by buckets of ids. Returns false, without any change, if the ids are too unevenly distributed.
  bool sort_by_bucket();

  size_t max_count_ = 0;
  bool truncated_ = false;
  std::vector<FoundObject> found_;
  std::vector<FoundObject> bucketed_;  // scratch of sort_by_bucket()
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_FOUND_OBJECTS_H_
