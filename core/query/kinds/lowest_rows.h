// Collector of the rows of one overlap query, contains query or group lookup: retains the rows with the lowest ids, up
// to a given number. The rows of an instance's triangles differ only in the triangle, so they are stored as one run
// with a list of triangles. A collector belongs to one thread.
#ifndef LOCUS_CORE_QUERY_KINDS_LOWEST_ROWS_H_
#define LOCUS_CORE_QUERY_KINDS_LOWEST_ROWS_H_

#include <vector>

#include "absl/types/span.h"
#include "core/query/kinds/found_objects.h"
#include "core/query/kinds/hit.h"
#include "core/query/kinds/overlap_columns.h"

namespace locus {

// Single row, or consecutive rows of one instance or compound that differ only in the triangle or part.
struct RowRun {
  Hit row;                    // t is 0; triangle is not set
  size_t first_triangle = 0;  // index of the run's first triangle in OverlapAnswer::triangles
  size_t triangle_count = 0;  // 0: a single row without a triangle

  size_t rows() const { return triangle_count == 0 ? 1 : triangle_count; }
};

// Result of one overlap query, contains query or group lookup.
struct OverlapAnswer {
  std::vector<RowRun> runs;
  std::vector<uint32_t> triangles;
  // Found objects, ascending by id, if an overlap or contains query found no instances; `runs` is then empty. In all
  // other cases `objects` is empty, and `runs` contains the rows of objects, too. The memory belongs to the QueryTask
  // and is valid until the next query of the task.
  absl::Span<const FoundObject> objects;
  uint64_t count = 0;      // number of rows; with count_only, `runs` and `objects` are empty
  bool truncated = false;  // more rows were found than are returned

  absl::Span<const uint32_t> triangles_of(const RowRun& run) const {
    return absl::MakeConstSpan(triangles).subspan(run.first_triangle, run.triangle_count);
  }
};

// Bounded collection of the rows with the lowest ids. The triangles of an instance are in storage order, or ascending
// by index if `sorted_triangles` is true. With CountOnly::kYes rows are only counted. Invariants: rows_ is the number
// of rows of all runs; after keep_lowest() rows_ is at most max_results_, and the runs ascend by id. Memory: twice
// max_results_ rows plus the rows of one offer().
class LowestRows {
 public:
  explicit LowestRows(uint32_t max_results, bool sorted_triangles, CountOnly count_only = CountOnly::kNo)
      : max_results_(max_results), sorted_triangles_(sorted_triangles), count_only_(count_only) {}

  // Adds a row without a triangle.
  void offer(const Hit& row);
  // Adds one row for each entry of `triangles`, which are triangles of the instance, or parts of the compound, of
  // `row`. Several calls for one instance must pass its triangles in storage order.
  void offer(const Hit& row, absl::Span<const uint32_t> triangles);
  // Returns the retained rows, ascending by id, and empties the collector. Call it once.
  OverlapAnswer finish();

 private:
  // Checks the invariants of the counts and of the last run, which is the only run that offer() changes.
  void check_invariants() const;
  // Checks the invariants of all runs after keep_lowest().
  void check_runs() const;
  bool in_order() const;
  // Sorts the runs by id, merges the runs of each instance, and drops the rows after the first max_results_ rows.
  void keep_lowest();

  const size_t max_results_;
  const bool sorted_triangles_;
  const CountOnly count_only_;
  size_t rows_ = 0;
  uint64_t count_ = 0;  // number of rows that were offered
  bool truncated_ = false;
  std::vector<RowRun> runs_;
  std::vector<uint32_t> triangles_;
};

// Adds the objects in `found` to `answer`, which has the rows of instances: retains at most options.max_results rows,
// ascending by id. With count_only, only adds to the number of rows.
void add_objects(OverlapAnswer& answer, FoundObjects& found, const SceneAtTime& moment, const OverlapOptions& options);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_LOWEST_ROWS_H_
