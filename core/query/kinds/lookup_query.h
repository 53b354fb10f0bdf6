// Lookup of objects and instances by id or group. Hidden ones (layers 0) are found too. Free functions; any thread,
// with a QueryTask of its own.
#ifndef LOCUS_CORE_QUERY_KINDS_LOOKUP_QUERY_H_
#define LOCUS_CORE_QUERY_KINDS_LOOKUP_QUERY_H_

#include "absl/container/flat_hash_map.h"
#include "core/query/kinds/overlap_query.h"

namespace locus {

// Returns the object at `moment` or the instance of `snapshot` with this id, with t = 0, or a miss. The hit borrows
// both.
Hit look_up(const SceneSnapshot& snapshot, const SceneAtTime& moment, Id id);

// Returns the objects at `moment` and the instances of each group, ascending by id. Duplicates in `groups` are answered
// once. Cost: O(all objects and instances), independent of the number of groups.
absl::flat_hash_map<Group, OverlapAnswer> look_up_groups(QueryTask& task, const SceneAtTime& moment,
                                                         absl::Span<const uint64_t> groups,
                                                         const OverlapOptions& options);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_LOOKUP_QUERY_H_
