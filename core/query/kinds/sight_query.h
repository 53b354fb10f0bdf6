// Sight of one viewer: how many sample points of each target the viewer sees. A sample is seen if, from one of the
// viewer's eyes, the segment to the sample is not blocked. Objects and triangles that intersect a segment block it,
// unless they belong to the group of the viewer or of the target. Free functions; any thread may call them with a
// QueryTask of its own.
#ifndef LOCUS_CORE_QUERY_KINDS_SIGHT_QUERY_H_
#define LOCUS_CORE_QUERY_KINDS_SIGHT_QUERY_H_

#include "absl/types/span.h"
#include "core/query/kinds/query_task.h"

namespace locus {

// Writes the number of seen samples of each target that viewer `i` looks at: one byte per target, or one byte if the
// block is pairwise. The caller must fill `seen` with zeros. Objects are searched as of `moment`; the positions of the
// eyes are relative to `origin`. A segment is blocked if a ray of mode ANY along it, with t_max 1, has a hit. If the
// batch ends during the search, some seen samples may not be counted. Cost: at most one search for each segment.
void look(QueryTask& task, const SceneAtTime& moment, const QueryBlock& block, const SightColumns& sight, Vec3d origin,
          size_t i, absl::Span<char> seen);

// Arguments of look() for one viewer of look_together(). `viewer` is look()'s argument `i`.
struct SightQuery {
  size_t viewer;
  const SceneAtTime* moment;
  Vec3d origin;
  absl::Span<char> seen;
};

// Returns the number of viewers of a block that one call of look_together() should search. Returns 0 if look() is
// faster, because a viewer has many segments or several eyes.
size_t viewers_together(const SightColumns& sight);

// Does the same as look() for each of several viewers of one block, and searches the segments of all these viewers
// together. Precondition: each viewer has one eye.
void look_together(QueryTask& task, const QueryBlock& block, const SightColumns& sight,
                   absl::Span<const SightQuery> queries);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_SIGHT_QUERY_H_
