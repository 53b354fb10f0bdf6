// Collector of the objects that one overlap or contains query finds: retains the objects with the lowest ids, up to a
// given number, and returns these objects ascending by id. A QueryTask reuses one collector for all queries of a chunk,
// so that memory is allocated once. A collector belongs to one thread.
#ifndef LOCUS_CORE_QUERY_KINDS_FOUND_OBJECTS_H_
#define LOCUS_CORE_QUERY_KINDS_FOUND_OBJECTS_H_

#include <vector>

#include "absl/types/span.h"
#include "core/base/check.h"
#include "core/base/ids.h"
#include "core/index/hash_grid/brick_scan.h"

namespace locus {

// Selects whether a query returns its rows or only the number of rows.
enum class CountOnly : uint8_t { kNo, kYes };

struct FoundObject {
  Id id = kNoId;
  GridRef object;
};

// Invariant: between calls, found_ has at most 2 * max_count_ objects, and none if objects are only counted. Memory:
// found_ and bucketed_ together have at most about 3 * max_count_ objects.
class FoundObjects {
 public:
  // Clears the collector for the next query, which retains at most `max_count` objects, or none with `count_only`.
  void restart(size_t max_count, CountOnly count_only = CountOnly::kNo);

  // Adds an object. Precondition: no object with its id was added since restart().
  void offer(const GridRef& object) {
    LOCUS_DCHECK_NE(object.entry().id, kNoId);
    ++count_;
    if (count_only_ == CountOnly::kYes) return;
    found_.push_back({object.entry().id, object});
    if (found_.size() > 2 * max_count_) keep_lowest();
    LOCUS_DCHECK_CALL(check_invariants());
  }
  // Returns the retained objects, ascending by id. The span is valid until the next call of restart() or offer().
  absl::Span<const FoundObject> finish();
  // Returns whether more than `max_count` objects were added, so that some were dropped. Call it after finish().
  bool truncated() const { return truncated_; }
  // Returns the number of objects that were added since restart().
  uint64_t count() const { return count_; }

 private:
  void check_invariants() const { LOCUS_DCHECK_LE(found_.size(), 2 * max_count_); }
  // Drops all objects except the max_count_ objects with the lowest ids.
  void keep_lowest();
  void sort();
  // Orders found_ by bucket, where each bucket is a range of ids; objects of the same bucket stay unsorted. Returns
  // false and leaves found_ unchanged if the ids are too unevenly distributed.
  bool sort_by_bucket();

  size_t max_count_ = 0;
  CountOnly count_only_ = CountOnly::kNo;
  uint64_t count_ = 0;
  bool truncated_ = false;
  std::vector<FoundObject> found_;
  std::vector<FoundObject> bucketed_;  // temporary memory of sort_by_bucket()
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_FOUND_OBJECTS_H_
