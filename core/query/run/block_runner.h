// Runs a run of queries of one block on one thread: into the answer's columns where each query has one row, into
// columns of its own where rows are counted.
#ifndef LOCUS_CORE_QUERY_RUN_BLOCK_RUNNER_H_
#define LOCUS_CORE_QUERY_RUN_BLOCK_RUNNER_H_

#include <atomic>
#include <utility>

#include "core/query/kinds/overlap_query.h"
#include "core/query/kinds/query_task.h"
#include "core/query/kinds/ray_query.h"
#include "core/query/run/batch_result.h"

namespace locus {

// Where the rows of a block go, and what its pieces tell each other.
struct BlockPlace {
  RowSpans rows;         // of all queries, where each has one
  char* hits = nullptr;  // the same of bytes
  // Rays that the kernels get at once. Many are answered faster than few, but a call cannot be stopped.
  std::atomic<uint32_t> rays_at_once{64};
};

class BlockRunner {
 public:
  // Rows beyond `max_bytes` of columns are dropped and their queries listed as truncated: nothing behind them would fit
  // the reply either.
  BlockRunner(QueryTask& task, const QueryBlock& block, const QueryTimes& moments, BlockPlace& place,
              uint64_t max_bytes);

  // Queries begin to end (exclusive), in order, or fewer where they turn out to be much work, but one at least. Returns
  // the first that is left.
  size_t run(size_t begin, size_t end);

  // Counts and rows of blocks that have them, and the queries that were cut, counted from 0 at the block's first.
  BlockResult take_rows() { return std::move(result_); }

 private:
  template <class Columns>
  size_t run_queries(const Columns& columns, size_t begin, size_t end);
  size_t run_queries(const RayColumns& rays, size_t begin, size_t end);
  template <class Columns, class RegionOf>
  void walk_regions(const Columns& columns, size_t begin, size_t end, const RegionOf& region_of);
  void run_query(const BallColumns& balls, size_t i);
  void run_query(const BoxColumns& boxes, size_t i);
  void run_query(const LookupColumns& lookup, size_t i);
  void run_query(const NearestColumns& nearest, size_t i);
  void take_ray(const RayColumns& rays, const RayAnswer& answer, size_t i);
  void write_hits(const RayColumns& rays, absl::Span<const Hit> hits, size_t i, const RowSpans& to, size_t row);
  void append_counted(const RayColumns& rays, const RayAnswer& answer, size_t i);
  void append_rows(const OverlapAnswer& answer, size_t i);
  void append_runs(const OverlapAnswer& answer, size_t i);
  void look_up_groups_at(const LookupColumns& lookup, size_t i);
  void count_rows(size_t rows, bool cut, size_t i);
  // In units that do not depend on the machine.
  uint64_t work_done() const;
  // Whether what is left should be a piece of its own.
  bool enough() const;
  void pace_rays(size_t rays, uint64_t work);

  QueryTask& task_;
  const QueryBlock& block_;
  const QueryTimes& moments_;
  BlockPlace& place_;
  const ColumnSet columns_;
  const uint64_t max_rows_;
  uint64_t rows_ = 0;
  // Answers of a lookup of groups, at the moment of the query of that number.
  absl::flat_hash_map<Group, OverlapAnswer> groups_;
  std::optional<size_t> groups_query_;
  BlockResult result_;
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_RUN_BLOCK_RUNNER_H_
