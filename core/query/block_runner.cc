#include "core/query/block_runner.h"

#include <algorithm>
#include <utility>

#include "core/query/lookup_query.h"
#include "core/query/ray_query.h"

namespace locus {
namespace {

// Rays that the kernels get at once. Fewer would leave them waiting at the end of each call; more would leave the
// caches.
constexpr size_t kRaysAtOnce = 256;

}  // namespace

BlockRunner::BlockRunner(QueryTask& task, const QueryBlock& block, const QueryMoments& moments, uint64_t max_bytes)
    : task_(task),
      block_(block),
      moments_(moments),
      columns_(returned_columns(block)),
      max_rows_(max_bytes / std::max(1u, row_bytes(columns_)) + 1) {}

BlockResult BlockRunner::run(size_t begin, size_t end) {
  task_.check();
  std::visit([&](const auto& kind) { run_queries(kind, begin, end); }, block_.kind);
  task_.check();  // books what is not booked yet: many small pieces use up a budget like a large one
  result_.work = task_.work();
  return std::move(result_);
}

template <class Columns>
void BlockRunner::run_queries(const Columns& columns, size_t begin, size_t end) {
  for (size_t i = begin; i < end; ++i) {
    run_query(columns, i);
    if (!task_.ended()) continue;
    const auto query = static_cast<uint32_t>(i);
    if (result_.truncated.empty() || result_.truncated.back() != query) result_.truncated.push_back(query);
  }
}

void BlockRunner::append_counted(absl::Span<const Hit> rows, bool truncated, size_t i, const RayRequest& request) {
  const size_t kept = std::min<uint64_t>(rows.size(), max_rows_ - rows_);
  const Winding winding = task_.snapshot().winding;
  for (const Hit& row : rows.subspan(0, kept)) {
    append_row(row, columns_, result_);
    append_surface(request, block_.frame, row, winding, columns_, result_);
  }
  count_rows(kept, truncated || kept < rows.size(), i);
}

void BlockRunner::append_runs(const OverlapAnswer& answer, size_t i) {
  size_t kept = 0;
  bool cut = answer.truncated;
  for (const RowRun& run : answer.runs) {
    const size_t rows = std::min<uint64_t>(run.rows(), max_rows_ - rows_ - kept);
    if (run.triangle_count != 0)
      append_triangle_rows(run.row, answer.triangles_of(run).subspan(0, rows), columns_, result_);
    else if (rows != 0)
      append_row(run.row, columns_, result_);
    cut = cut || rows < run.rows();
    kept += rows;
  }
  count_rows(kept, cut, i);
}

void BlockRunner::count_rows(size_t rows, bool cut, size_t i) {
  rows_ += rows;
  result_.counts.push_back(static_cast<uint32_t>(rows));
  if (cut) result_.truncated.push_back(static_cast<uint32_t>(i));
}

void BlockRunner::run_queries(const RayColumns& rays, size_t begin, size_t end) {
  const Winding winding = task_.snapshot().winding;
  for (size_t first = begin; first < end; first += kRaysAtOnce) {
    const size_t last = std::min(end, first + kRaysAtOnce);
    const RayAnswers answers = run_rays(task_, block_, rays, moments_, winding, first, last);
    for (size_t i = first; i < last; ++i)
      append_ray(rays, answers[i - first], ray_request(block_, rays, winding, i), i);
  }
}

void BlockRunner::append_ray(const RayColumns& rays, const RayAnswer& answer, const RayRequest& request, size_t i) {
  if (rays.mode == RayMode::kAll) return append_counted(answer.hits, answer.truncated, i, request);
  if (answer.truncated) result_.truncated.push_back(static_cast<uint32_t>(i));
  if (rays.mode == RayMode::kAny) {
    result_.hits.push_back(answer.hits.empty() ? '\0' : '\1');
    return;
  }
  const Hit hit = answer.hits.empty() ? Hit{} : answer.hits.front();
  append_row(hit, columns_, result_);
  append_surface(request, block_.frame, hit, task_.snapshot().winding, columns_, result_);
}

void BlockRunner::run_query(const BallColumns& balls, size_t i) {
  OverlapAnswer answer;
  if (!task_.ended())
    answer = run_ball(task_, moments_.of(i), ball_of(block_, balls, i), overlap_options(block_, balls.detail),
                      Filter(block_, i));
  append_runs(answer, i);
}

void BlockRunner::run_query(const BoxColumns& boxes, size_t i) {
  OverlapAnswer answer;
  if (!task_.ended())
    answer = run_box(task_, moments_.of(i), box_of(block_, boxes, i), overlap_options(block_, boxes.detail),
                     Filter(block_, i));
  append_runs(answer, i);
}

void BlockRunner::run_query(const NearestColumns& nearest, size_t i) {
  const NearestRequest request = nearest_request(block_, nearest, i);
  std::vector<Hit> rows;
  if (!task_.ended()) rows = run_nearest(task_, moments_.of(i), request, Filter(block_, i));
  const size_t kept = std::min<uint64_t>(rows.size(), max_rows_ - rows_);
  for (const Hit& row : absl::MakeConstSpan(rows).subspan(0, kept)) {
    append_row(row, columns_, result_);
    append_nearest_point(request, block_.frame, row, columns_, result_);
  }
  count_rows(kept, kept < rows.size(), i);
}

// One pass over the objects answers all queries in a row that ask about the same moment.
void BlockRunner::look_up_groups_at(const LookupColumns& lookup, size_t i) {
  const bool same = groups_query_ && (!moments_.asks_past() || moments_.time(*groups_query_) == moments_.time(i));
  if (same || task_.ended()) return;
  groups_query_ = i;
  groups_ = look_up_groups(task_, moments_.of(i), lookup.groups, overlap_options(block_, StaticDetail::kInstances));
}

void BlockRunner::run_query(const LookupColumns& lookup, size_t i) {
  if (lookup.groups.empty())
    return append_row(look_up(task_.snapshot(), moments_.of(i), lookup.ids[i]), columns_, result_);
  look_up_groups_at(lookup, i);
  const OverlapAnswer& answer = groups_[lookup.groups[i]];
  append_runs(answer, i);
}

}  // namespace locus
