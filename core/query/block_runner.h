// Runs a run of queries of one block on one thread, into columns of its own.
#ifndef LOCUS_CORE_QUERY_BLOCK_RUNNER_H_
#define LOCUS_CORE_QUERY_BLOCK_RUNNER_H_

#include "core/query/overlap_query.h"
#include "core/query/query_task.h"
#include "core/query/ray_query.h"
#include "core/query/rows.h"

namespace locus {

class BlockRunner {
 public:
  // Rows beyond `max_bytes` of columns are dropped and their queries listed as truncated: nothing behind them would fit
  // the reply either.
  BlockRunner(QueryTask& task, const QueryBlock& block, const QueryMoments& moments, uint64_t max_bytes);

  // Queries begin to end (exclusive), in order. `truncated` counts from 0 at the block's first query.
  BlockResult run(size_t begin, size_t end);

 private:
  template <class Columns>
  void run_queries(const Columns& columns, size_t begin, size_t end);
  void run_queries(const RayColumns& rays, size_t begin, size_t end);
  void run_query(const BallColumns& balls, size_t i);
  void run_query(const BoxColumns& boxes, size_t i);
  void run_query(const LookupColumns& lookup, size_t i);
  void run_query(const NearestColumns& nearest, size_t i);
  void append_ray(const RayColumns& rays, const RayAnswer& answer, const RayRequest& request, size_t i);
  void append_counted(absl::Span<const Hit> rows, bool truncated, size_t i, const RayRequest& request);
  void append_runs(const OverlapAnswer& answer, size_t i);
  void look_up_groups_at(const LookupColumns& lookup, size_t i);
  void count_rows(size_t rows, bool cut, size_t i);

  QueryTask& task_;
  const QueryBlock& block_;
  const QueryMoments& moments_;
  const ColumnSet columns_;
  const uint64_t max_rows_;
  uint64_t rows_ = 0;
  // Answers of a lookup of groups, at the moment of the query of that number.
  absl::flat_hash_map<Group, OverlapAnswer> groups_;
  std::optional<size_t> groups_query_;
  BlockResult result_;
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_BLOCK_RUNNER_H_
