// Runs a chunk of a block: consecutive queries, on one thread. The output depends on the RowLayout of the block. Rows
// of kDense and bytes of kBytes and kMatrix are written directly into the reply's columns. Rows of kCounted are
// collected in memory of the runner, since their positions in the reply depend on how many rows the earlier chunks
// have.
//
// Threads: a runner belongs to one thread. Invariant: for a kCounted block, the runner has at most max_rows_ rows, and
// one row count for each query that was run. If the block has count_only, the runner has only the row counts.
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
  RowSpans rows;          // kDense blocks: rows of all queries
  char* bytes = nullptr;  // kBytes and kMatrix blocks: bytes_per_query() bytes per query; otherwise null
  // Number of rays for the next call of the kernels. More rays per call increase the throughput, but a call cannot be
  // interrupted.
  std::atomic<uint32_t> rays_per_call{64};
};

class BlockRunner {
 public:
  // Borrows all arguments. `max_bytes` is the free space of the reply in bytes. The runner drops the rows of a kCounted
  // block that do not fit into this space, and lists their queries as truncated.
  BlockRunner(QueryTask& task, const QueryBlock& block, const QueryTimes& times, const QueryOrigins& origins,
              BlockOutput& output, uint64_t max_bytes);

  // Answers queries [begin, end) in order. Stops early, but after at least one query, if the queries turn out to be
  // expensive. Returns the index of the first query that is not answered. Precondition: begin < end. Call it once.
  size_t run(size_t begin, size_t end);

  // Returns the row counts and rows of a counted block, and, for any block, the indices of truncated queries in the
  // block.
  CollectedRows take_rows() { return std::move(result_); }

 private:
  // Checks the class invariants after queries [begin, reached) were answered.
  void check_invariants(size_t begin, size_t reached) const;
  template <class Columns>
  size_t run_queries(const Columns& columns, size_t begin, size_t end);
  size_t run_queries(const RayColumns& rays, size_t begin, size_t end);
  size_t run_queries(const SightColumns& sight, size_t begin, size_t end);
  template <class Columns, class RegionOf>
  void walk_regions(const Columns& columns, size_t begin, size_t end, const RegionOf& region_of);
  void run_query(const BallColumns& balls, size_t i);
  void run_query(const BoxColumns& boxes, size_t i);
  void run_query(const CapsuleColumns& capsules, size_t i);
  void run_query(const LookupColumns& lookup, size_t i);
  void run_query(const NearestColumns& nearest, size_t i);
  void run_query(const SweepColumns& sweeps, size_t i);
  void run_query(const FrustumColumns& frustums, size_t i);
  void run_query(const SightColumns& sight, size_t i);
  void run_query(const ContainsColumns& contains, size_t i);
  void run_query(const PairColumns& pairs, size_t i);
  void run_query(const CellColumns& cells, size_t i);
  // In the following functions, Columns is RayColumns or SweepColumns.
  template <class Columns>
  void write_answer(const Columns& columns, const RayAnswer& answer, size_t i);
  template <class Columns>
  void write_hits(const Columns& columns, absl::Span<const Hit> hits, size_t i, const RowSpans& to, size_t row);
  template <class Columns>
  void append_counted(const Columns& columns, const RayAnswer& answer, size_t i);
  void write_surfaces(const RayColumns& rays, absl::Span<const Hit> hits, size_t i, const RowSpans& to, size_t row);
  void write_surfaces(const SweepColumns& sweeps, absl::Span<const Hit> hits, size_t i, const RowSpans& to, size_t row);
  void append_rows(const OverlapAnswer& answer, size_t i);
  void append_runs(const OverlapAnswer& answer, size_t i);
  // Appends the rows of a ball, capsule or box query, including the columns t, normal and point of their contacts.
  template <class Solid>
  void append_contacts(const OverlapAnswer& answer, const Solid& solid, size_t i);
  template <class Solid>
  void write_contacts(const OverlapAnswer& answer, const Solid& solid, size_t i, size_t rows);
  void look_up_groups_at(const LookupColumns& lookup, size_t i);
  void count_rows(size_t rows, bool cut, size_t i);
  // Records the number of rows of the next query of a block with count_only.
  void write_count(uint64_t rows);
  // Writes an empty answer for query `i`: a miss, bytes of 0, or a row count of 0.
  void write_nothing(size_t i);
  // Adds query `i` to the list of truncated queries.
  void mark_truncated(size_t i);
  // Returns the work so far as the number of nodes, cells, tests and rows, which does not depend on the speed of the
  // machine.
  uint64_t work_done() const;
  // Returns true if the chunk has done so much work that its remaining queries should become new chunks. Always false
  // once the groups of a block were looked up.
  bool should_split() const;
  // Sets rays_per_call from the work of the last call, in which `rays` rays needed `work`, in units of work_done().
  void adapt_rays_per_call(size_t rays, uint64_t work);

  QueryTask& task_;
  const QueryBlock& block_;
  const QueryTimes& times_;
  const QueryOrigins& origins_;
  BlockOutput& output_;
  const ColumnSet columns_;
  const uint64_t max_rows_;
  uint64_t rows_ = 0;
  // Result of the last lookup of all groups, at the effective time of query groups_query_.
  absl::flat_hash_map<Group, OverlapAnswer> groups_;
  std::optional<size_t> groups_query_;
  CollectedRows result_;
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_RUN_BLOCK_RUNNER_H_
