// One ball or box against everything in a snapshot: rows of instances or their triangles and of objects, ascending by
// id.
#ifndef LOCUS_CORE_QUERY_OVERLAP_QUERY_H_
#define LOCUS_CORE_QUERY_OVERLAP_QUERY_H_

#include <vector>

#include "core/geometry/ball.h"
#include "core/geometry/obb.h"
#include "core/query/hit.h"
#include "core/query/query_task.h"

namespace locus {

struct OverlapOptions {
  Source source;
  Precision precision;
  StaticDetail detail;
  uint32_t max_results;
  Id after_id;
};

OverlapOptions overlap_options(const QueryBlock& block, StaticDetail detail);

struct OverlapAnswer {
  std::vector<Hit> rows;   // t is 0
  bool truncated = false;  // there were more, of higher ids
};

OverlapAnswer run_ball(QueryTask& task, const Balld& ball, const OverlapOptions& options, const Filter& filter);
OverlapAnswer run_box(QueryTask& task, const Obbd& box, const OverlapOptions& options, const Filter& filter);

// The ball or box of query `i` of a block, in world axes.
Balld ball_of(const QueryBlock& block, const BallColumns& balls, size_t i);
Obbd box_of(const QueryBlock& block, const BoxColumns& boxes, size_t i);

// Keeps the rows that come first in the order of ids (then of triangles), at most a given number. Memory is bounded by
// three times that number, whatever is offered.
class LowestRows {
 public:
  explicit LowestRows(uint32_t max_results, bool sorted_triangles)
      : max_results_(max_results), sorted_triangles_(sorted_triangles) {}

  void offer(const Hit& row);
  // Rows like `head` for triangles in storage order, counted from `storage`.
  void offer(const Hit& head, absl::Span<const uint32_t> triangles, uint32_t storage);
  OverlapAnswer finish();

 private:
  bool before(const Hit& a, const Hit& b) const;
  void keep_lowest();

  const size_t max_results_;
  const bool sorted_triangles_;
  OverlapAnswer answer_;
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_OVERLAP_QUERY_H_
