// The rows of one ball or box, or of one group, in the order of ids (then of triangles), at most a given number. Rows
// of one instance's triangles differ by a number only, and are kept as such. One thread.
#ifndef LOCUS_CORE_QUERY_KINDS_LOWEST_ROWS_H_
#define LOCUS_CORE_QUERY_KINDS_LOWEST_ROWS_H_

#include <vector>

#include "absl/types/span.h"
#include "core/query/kinds/found_objects.h"
#include "core/query/kinds/hit.h"

namespace locus {

// One row, or one for each of some triangles of an instance.
struct RowRun {
  Hit row;                    // t is 0; without triangle
  size_t first_triangle = 0;  // in OverlapAnswer::triangles
  size_t triangle_count = 0;  // 0: one row without triangle

  size_t rows() const { return triangle_count == 0 ? 1 : triangle_count; }
};

struct OverlapAnswer {
  std::vector<RowRun> runs;
  std::vector<uint32_t> triangles;
  // In place of runs where only objects were found: they, ascending by id, as the task that was asked holds them until
  // the next query.
  absl::Span<const FoundObject> objects;
  bool truncated = false;  // there were more, of higher ids

  absl::Span<const uint32_t> triangles_of(const RowRun& run) const {
    return absl::MakeConstSpan(triangles).subspan(run.first_triangle, run.triangle_count);
  }
};

// Keeps the rows that come first. Memory is bounded by twice that number and what is offered at once.
class LowestRows {
 public:
  explicit LowestRows(uint32_t max_results, bool sorted_triangles)
      : max_results_(max_results), sorted_triangles_(sorted_triangles) {}

  // A row without triangle.
  void offer(const Hit& row);
  // One row for each of some triangles of an instance; those of one instance in storage order, call by call.
  void offer(const Hit& row, absl::Span<const uint32_t> triangles);
  OverlapAnswer finish();

 private:
  bool in_order() const;
  // Puts runs in order and drops the rows behind the most results.
  void keep_lowest();

  const size_t max_results_;
  const bool sorted_triangles_;
  size_t rows_ = 0;
  OverlapAnswer answer_;
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_LOWEST_ROWS_H_
