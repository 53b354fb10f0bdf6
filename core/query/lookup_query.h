// Objects and instances by name: where they are and what they carry. Hidden ones are found too.
#ifndef LOCUS_CORE_QUERY_LOOKUP_QUERY_H_
#define LOCUS_CORE_QUERY_LOOKUP_QUERY_H_

#include <vector>

#include "core/query/overlap_query.h"

namespace locus {

// t is 0 where something has the id.
Hit look_up(const SceneSnapshot& snapshot, Id id);

// For each group its objects and instances, ascending by id. O(all objects and instances), once for all groups.
std::vector<OverlapAnswer> look_up_groups(QueryTask& task, absl::Span<const uint64_t> groups,
                                          const OverlapOptions& options);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_LOOKUP_QUERY_H_
