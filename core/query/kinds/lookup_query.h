// Objects and instances by name: where they are and what they carry. Hidden ones are found too.
#ifndef LOCUS_CORE_QUERY_KINDS_LOOKUP_QUERY_H_
#define LOCUS_CORE_QUERY_KINDS_LOOKUP_QUERY_H_

#include "absl/container/flat_hash_map.h"
#include "core/query/kinds/overlap_query.h"

namespace locus {

// t is 0 where something has the id. Instances are the snapshot's, objects those of `moment`, which the hit borrows.
Hit look_up(const SceneSnapshot& snapshot, const SceneAtTime& moment, Id id);

// For each group its objects and instances, ascending by id; once, however often it is asked. O(all objects and
// instances) for all groups together.
absl::flat_hash_map<Group, OverlapAnswer> look_up_groups(QueryTask& task, const SceneAtTime& moment,
                                                         absl::Span<const uint64_t> groups,
                                                         const OverlapOptions& options);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_LOOKUP_QUERY_H_
