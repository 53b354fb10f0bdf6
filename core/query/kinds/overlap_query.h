// One ball or box against everything in a snapshot: rows of instances or their triangles and of objects, ascending by
// id.
#ifndef LOCUS_CORE_QUERY_KINDS_OVERLAP_QUERY_H_
#define LOCUS_CORE_QUERY_KINDS_OVERLAP_QUERY_H_

#include "core/geometry/ball.h"
#include "core/geometry/obb.h"
#include "core/query/kinds/lowest_rows.h"
#include "core/query/kinds/query_task.h"

namespace locus {

struct OverlapOptions {
  Source source;
  Precision precision;
  StaticDetail detail;
  uint32_t max_results;
  Id after_id;
};

OverlapOptions overlap_options(const QueryBlock& block, StaticDetail detail);

// `moment` says when; the answer borrows it.
OverlapAnswer run_ball(QueryTask& task, const SceneAtTime& moment, const Balld& ball, const OverlapOptions& options,
                       const Filter& filter);
OverlapAnswer run_box(QueryTask& task, const SceneAtTime& moment, const Obbd& box, const OverlapOptions& options,
                      const Filter& filter);

// What such a query asks of the grid of objects.
GridRegion ball_region(const SceneAtTime& moment, const Balld& ball, const OverlapOptions& options);
GridRegion box_region(const SceneAtTime& moment, const Obbd& box, const OverlapOptions& options);

// The ball or box of query `i` of a block, in world axes.
Balld ball_of(const QueryBlock& block, const BallColumns& balls, size_t i);
Obbd box_of(const QueryBlock& block, const BoxColumns& boxes, size_t i);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_OVERLAP_QUERY_H_
