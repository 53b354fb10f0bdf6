// Sight of one viewer: how many sample points of each target it sees. A sample is seen if a segment from one of the
// viewer's eyes to the sample meets nothing outside the groups of the viewer and the target. Free functions; any thread
// may call them with a QueryTask of its own.
#ifndef LOCUS_CORE_QUERY_KINDS_SIGHT_QUERY_H_
#define LOCUS_CORE_QUERY_KINDS_SIGHT_QUERY_H_

#include "absl/types/span.h"
#include "core/query/kinds/query_task.h"

namespace locus {

// Writes the number of seen samples of each target that viewer `i` looks at: one byte per target, or one byte if the
// block is pairwise. `seen` is zero at the beginning. Objects are searched as of `moment`; the eyes count from
// `origin`. Each segment is decided as a ray of mode ANY with t_max 1. If the batch ends meanwhile, samples may be
// missing. Cost: at most one search for each segment.
void look(QueryTask& task, const SceneAtTime& moment, const QueryBlock& block, const SightColumns& sight, Vec3d origin,
          size_t i, absl::Span<char> seen);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_SIGHT_QUERY_H_
