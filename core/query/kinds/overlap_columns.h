// Columns of ball, box and capsule queries as solids in world axes, and the settings of their blocks. Pure functions;
// any thread.
#ifndef LOCUS_CORE_QUERY_KINDS_OVERLAP_COLUMNS_H_
#define LOCUS_CORE_QUERY_KINDS_OVERLAP_COLUMNS_H_

#include "core/geometry/ball.h"
#include "core/geometry/capsule.h"
#include "core/geometry/obb.h"
#include "core/query/kinds/found_objects.h"
#include "core/query/query_batch.h"

namespace locus {

// Settings of a block that apply to each of its overlap queries.
struct OverlapOptions {
  Source source;
  Precision precision;
  StaticDetail detail;
  uint32_t max_results;
  Id after_id;
  CountOnly count_only;
};

// Returns the options of a block. A max_results of 0 becomes limits::kDefaultMaxResults.
OverlapOptions overlap_options(const QueryBlock& block, StaticDetail detail);

// Return the ball, box or capsule of query `i` of a block, in world axes. The positions of the query are relative to
// `origin`.
Balld ball_of(Vec3d origin, const BallColumns& balls, size_t i);
Obbd box_of(Vec3d origin, const BoxColumns& boxes, size_t i);
Capsule capsule_of(Vec3d origin, const CapsuleColumns& capsules, size_t i);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_OVERLAP_COLUMNS_H_
