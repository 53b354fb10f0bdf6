// The objects that one ball or box found: the lowest by id, at most a given number, in order. Kept from query to query,
// so that their memory is asked for once a piece. One thread.
#ifndef LOCUS_CORE_QUERY_KINDS_FOUND_OBJECTS_H_
#define LOCUS_CORE_QUERY_KINDS_FOUND_OBJECTS_H_

#include <vector>

#include "absl/types/span.h"
#include "core/base/ids.h"
#include "core/index/hash_grid/brick_scan.h"

namespace locus {

struct FoundObject {
  Id id = kNoId;
  GridRef object;
};

// Memory is bounded by three times the number that is kept at most.
class FoundObjects {
 public:
  // Forgets what there is. At most `most` objects are kept from now on.
  void restart(size_t most);

  // One whose id was not offered yet.
  void offer(const GridRef& object) {
    found_.push_back({object.entry().id, object});
    if (found_.size() > 2 * most_) keep_lowest();
  }
  // Ascending by id; good until the next call of anything else here.
  absl::Span<const FoundObject> finish();
  // Whether more were offered than are kept.
  bool truncated() const { return truncated_; }

 private:
  void keep_lowest();
  void sort();
  // Puts them in the order of their ids but for neighbours; false where the ids are too uneven for that.
  bool spread();

  size_t most_ = 0;
  bool truncated_ = false;
  std::vector<FoundObject> found_, spread_;
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_FOUND_OBJECTS_H_
