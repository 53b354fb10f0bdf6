// Rows of one ball or box, or of one group, ascending by id and then by triangle, at most a given number. The rows of
// one instance's triangles differ only by the triangle, so they are stored as one run with a list of triangles. One
// thread.
#ifndef LOCUS_CORE_QUERY_KINDS_LOWEST_ROWS_H_
#define LOCUS_CORE_QUERY_KINDS_LOWEST_ROWS_H_

#include <vector>

#include "absl/types/span.h"
#include "core/query/kinds/found_objects.h"
#include "core/query/kinds/hit.h"

namespace locus {

// One row, or one row per triangle of a list for an instance.
struct RowRun {
  Hit row;                    // t is 0; triangle is not set
  size_t first_triangle = 0;  // index in OverlapAnswer::triangles
  size_t triangle_count = 0;  // 0: one row without triangle

  size_t rows() const { return triangle_count == 0 ? 1 : triangle_count; }
};

// Result of one overlap query or group.
struct OverlapAnswer {
  std::vector<RowRun> runs;
  std::vector<uint32_t> triangles;
  // Objects ascending by id, in place of runs, if only objects were found. They belong to the QueryTask and are valid
  // until its next query.
  absl::Span<const FoundObject> objects;
  bool truncated = false;  // there were more rows, of higher ids

  absl::Span<const uint32_t> triangles_of(const RowRun& run) const {
    return absl::MakeConstSpan(triangles).subspan(run.first_triangle, run.triangle_count);
  }
};

// Bounded collection of the lowest rows. Invariants: rows_ is the number of rows of all runs; after keep_lowest() it is
// at most max_results_ and runs ascend by id. Memory: twice max_results_ rows plus the rows of one offer().
class LowestRows {
 public:
  explicit LowestRows(uint32_t max_results, bool sorted_triangles)
      : max_results_(max_results), sorted_triangles_(sorted_triangles) {}

  // Adds a row without a triangle.
  void offer(const Hit& row);
  // Adds one row per triangle of an instance. Several calls for one instance add its triangles in storage order.
  void offer(const Hit& row, absl::Span<const uint32_t> triangles);
  // Returns the lowest rows in order. Call it once.
  OverlapAnswer finish();

 private:
  // Checks what offer() changes: the last run.
  void check_invariants() const;
  // Checks all runs, in order.
  void check_runs() const;
  bool in_order() const;
  // Sorts the runs, merges those of one instance, and drops rows beyond max_results_.
  void keep_lowest();

  const size_t max_results_;
  const bool sorted_triangles_;
  size_t rows_ = 0;
  OverlapAnswer answer_;
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_LOWEST_ROWS_H_
