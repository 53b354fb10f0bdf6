// Overlap of one ball or box with a snapshot: rows of objects, and of instances or their triangles, ascending by id.
// Free functions; any thread, with a QueryTask of its own.
#ifndef LOCUS_CORE_QUERY_KINDS_OVERLAP_QUERY_H_
#define LOCUS_CORE_QUERY_KINDS_OVERLAP_QUERY_H_

#include "core/geometry/ball.h"
#include "core/geometry/obb.h"
#include "core/query/kinds/lowest_rows.h"
#include "core/query/kinds/query_task.h"

namespace locus {

// Settings of a block that its overlap queries share.
struct OverlapOptions {
  Source source;
  Precision precision;
  StaticDetail detail;
  uint32_t max_results;
  Id after_id;
};

// Returns the options of a block, with its default of max_results.
OverlapOptions overlap_options(const QueryBlock& block, StaticDetail detail);

// Answer one ball or box in world axes, with objects at `moment`. The answer borrows `moment`, and found objects from
// `task` until its next query. Cost: the nodes, cells and primitives that meet the region, and the sorting of the rows.
OverlapAnswer run_ball(QueryTask& task, const SceneAtTime& moment, const Balld& ball, const OverlapOptions& options,
                       const Filter& filter);
OverlapAnswer run_box(QueryTask& task, const SceneAtTime& moment, const Obbd& box, const OverlapOptions& options,
                      const Filter& filter);

// Return the region of the grid of objects that such a query searches.
GridRegion ball_region(const SceneAtTime& moment, const Balld& ball, const OverlapOptions& options);
GridRegion box_region(const SceneAtTime& moment, const Obbd& box, const OverlapOptions& options);

// Return the ball or box of query `i` of a block, in world axes.
Balld ball_of(const QueryBlock& block, const BallColumns& balls, size_t i);
Obbd box_of(const QueryBlock& block, const BoxColumns& boxes, size_t i);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_OVERLAP_QUERY_H_
