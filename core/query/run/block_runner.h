// Runs consecutive queries of one block on one thread. Dense rows and bytes go directly into the reply's columns;
// counted rows are collected in columns of the runner, since their positions depend on the chunks before.
//
// Threads: a runner belongs to one thread. Invariant: the runner keeps at most max_rows_ rows, and one count per query
// that was run if the block is counted.
#ifndef LOCUS_CORE_QUERY_RUN_BLOCK_RUNNER_H_
#define LOCUS_CORE_QUERY_RUN_BLOCK_RUNNER_H_

#include <atomic>
#include <utility>

#include "core/base/check.h"
#include "core/query/kinds/overlap_query.h"
#include "core/query/kinds/query_task.h"
#include "core/query/kinds/ray_query.h"
#include "core/query/run/collected_rows.h"

namespace locus {

// Output columns of a block, and the state that its chunks share.
struct BlockOutput {
  RowSpans rows;         // dense blocks: rows of all queries
  char* hits = nullptr;  // byte blocks: bytes of all queries
  // Number of rays for the next call of the kernels. Throughput grows with it, but a call cannot be interrupted.
  std::atomic<uint32_t> rays_per_call{64};
};

class BlockRunner {
 public:
  // Borrows all arguments. Rows beyond `max_bytes` of columns are dropped and their queries listed as truncated: later
  // rows would not fit the reply either.
  BlockRunner(QueryTask& task, const QueryBlock& block, const QueryTimes& times, BlockOutput& output,
              uint64_t max_bytes);

  // Answers queries [begin, end) in order, or fewer if they turn out to be expensive, but at least one. Returns the
  // first query that is not answered. Precondition: begin < end. Called once.
  size_t run(size_t begin, size_t end);

  // Returns the collected counts and rows (counted blocks) and the truncated queries as indices into the block.
  CollectedRows take_rows() { return std::move(result_); }

 private:
  // Checks the class invariants after the answers to queries [begin, reached).
  void check_invariants(size_t begin, size_t reached) const;
  template <class Columns>
  size_t run_queries(const Columns& columns, size_t begin, size_t end);
  size_t run_queries(const RayColumns& rays, size_t begin, size_t end);
  template <class Columns, class RegionOf>
  void walk_regions(const Columns& columns, size_t begin, size_t end, const RegionOf& region_of);
  void run_query(const BallColumns& balls, size_t i);
  void run_query(const BoxColumns& boxes, size_t i);
  void run_query(const LookupColumns& lookup, size_t i);
  void run_query(const NearestColumns& nearest, size_t i);
  void write_ray(const RayColumns& rays, const RayAnswer& answer, size_t i);
  void write_hits(const RayColumns& rays, absl::Span<const Hit> hits, size_t i, const RowSpans& to, size_t row);
  void append_counted(const RayColumns& rays, const RayAnswer& answer, size_t i);
  void append_rows(const OverlapAnswer& answer, size_t i);
  void append_runs(const OverlapAnswer& answer, size_t i);
  void look_up_groups_at(const LookupColumns& lookup, size_t i);
  void count_rows(size_t rows, bool cut, size_t i);
  // Returns the work so far, in units that do not depend on the machine.
  uint64_t work_done() const;
  // Returns whether the remaining queries should become a chunk of their own.
  bool should_split() const;
  // Adapts rays_per_call to the work that the last call took.
  void adapt_rays_per_call(size_t rays, uint64_t work);

  QueryTask& task_;
  const QueryBlock& block_;
  const QueryTimes& times_;
  BlockOutput& output_;
  const ColumnSet columns_;
  const uint64_t max_rows_;
  uint64_t rows_ = 0;
  // Result of a lookup of all groups, at the time of query groups_query_.
  absl::flat_hash_map<Group, OverlapAnswer> groups_;
  std::optional<size_t> groups_query_;
  CollectedRows result_;
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_RUN_BLOCK_RUNNER_H_
