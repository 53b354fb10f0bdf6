// Lookup of objects and instances by id or group. Hidden objects and instances (layers 0) are found too. Free
// functions; any thread may call them with a QueryTask of its own.
#ifndef LOCUS_CORE_QUERY_KINDS_LOOKUP_QUERY_H_
#define LOCUS_CORE_QUERY_KINDS_LOOKUP_QUERY_H_

#include "absl/container/flat_hash_map.h"
#include "core/query/kinds/overlap_query.h"

namespace locus {

// Returns a hit with t = 0 on the object or instance of `moment` with this id. Returns a miss if the id is unknown, or
// if a task with brute force ends before it has found the value. The hit borrows from `moment`.
Hit look_up(QueryTask& task, const SceneAtTime& moment, Id id);

// Returns, for each group, one row for each object at `moment` and each instance that belongs to the group. The ids
// of the rows are above options.after_id and ascending; each group has at most options.max_results rows. A group that
// occurs several times in `groups` has one entry in the result. Cost: O(instances), plus O(objects of the groups) or,
// if that is less or the task uses brute force, O(all objects).
absl::flat_hash_map<Group, OverlapAnswer> look_up_groups(QueryTask& task, const SceneAtTime& moment,
                                                         absl::Span<const uint64_t> groups,
                                                         const OverlapOptions& options);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_LOOKUP_QUERY_H_
