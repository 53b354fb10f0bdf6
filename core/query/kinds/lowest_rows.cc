#include "core/query/kinds/lowest_rows.h"

#include <algorithm>
#include <utility>

#include "core/base/check.h"

namespace locus {
namespace {

bool lower_run_id(const RowRun& a, const RowRun& b) { return a.row.id < b.row.id; }

}  // namespace

void LowestRows::offer(const Hit& row) {
  LOCUS_DCHECK_NE(row.id, kNoId);
  ++count_;
  if (count_only_ == CountOnly::kYes) return;
  runs_.push_back({row});
  ++rows_;
  if (rows_ > 2 * max_results_) keep_lowest();
  LOCUS_DCHECK_CALL(check_invariants());
}

void LowestRows::offer(const Hit& row, absl::Span<const uint32_t> triangles) {
  LOCUS_DCHECK_NE(row.id, kNoId);
  if (triangles.empty()) return;
  count_ += triangles.size();
  if (count_only_ == CountOnly::kYes) return;
  if (runs_.empty() || runs_.back().row.id != row.id) runs_.push_back({row, triangles_.size(), 0});
  runs_.back().triangle_count += triangles.size();
  triangles_.insert(triangles_.end(), triangles.begin(), triangles.end());
  rows_ += triangles.size();
  if (rows_ > 2 * max_results_) keep_lowest();
  LOCUS_DCHECK_CALL(check_invariants());
}

void LowestRows::check_invariants() const {
  LOCUS_DCHECK_LE(rows_, 2 * max_results_);
  LOCUS_DCHECK_LE(runs_.size(), rows_);
  LOCUS_DCHECK_LE(triangles_.size(), rows_);
  if (runs_.empty() || runs_.back().triangle_count == 0) return;
  LOCUS_DCHECK_EQ(runs_.back().first_triangle + runs_.back().triangle_count, triangles_.size());
}

void LowestRows::check_runs() const {
  LOCUS_DCHECK_LE(rows_, max_results_);
  LOCUS_DCHECK(std::is_sorted(runs_.begin(), runs_.end(), lower_run_id));
  size_t rows = 0, triangles = 0;
  for (const RowRun& run : runs_) {
    if (run.triangle_count != 0) LOCUS_DCHECK_EQ(run.first_triangle, triangles);
    triangles += run.triangle_count;
    rows += run.rows();
  }
  LOCUS_DCHECK_EQ(rows, rows_);
  LOCUS_DCHECK_EQ(triangles, triangles_.size());
}

bool LowestRows::in_order() const {
  return !sorted_triangles_ && std::is_sorted(runs_.begin(), runs_.end(), lower_run_id);
}

void LowestRows::keep_lowest() {
  if (rows_ == 0 || (rows_ <= max_results_ && in_order())) return;
  truncated_ |= rows_ > max_results_;
  std::vector<RowRun> all_runs = std::exchange(runs_, {});
  const std::vector<uint32_t> all_triangles = std::exchange(triangles_, {});
  // An instance may have two runs: a run that an earlier call of keep_lowest() made, and a run with the triangles that
  // were added after that call. The stable sort preserves their order.
  std::stable_sort(all_runs.begin(), all_runs.end(), lower_run_id);
  rows_ = 0;
  for (size_t i = 0; i < all_runs.size() && rows_ < max_results_;) {
    RowRun& kept = runs_.emplace_back(all_runs[i]);
    const size_t first = kept.first_triangle = triangles_.size();
    for (; i < all_runs.size() && all_runs[i].row.id == kept.row.id; ++i) {
      const auto triangles = all_triangles.begin() + static_cast<std::ptrdiff_t>(all_runs[i].first_triangle);
      triangles_.insert(triangles_.end(), triangles,
                        triangles + static_cast<std::ptrdiff_t>(all_runs[i].triangle_count));
    }
    const auto begin = triangles_.begin() + static_cast<std::ptrdiff_t>(first);
    if (sorted_triangles_) std::sort(begin, triangles_.end());
    kept.triangle_count = std::min(triangles_.size() - first, max_results_ - rows_);
    triangles_.resize(first + kept.triangle_count);
    rows_ += kept.rows();
  }
}

OverlapAnswer LowestRows::finish() {
  keep_lowest();
  LOCUS_DCHECK_CALL(check_runs());
  // Member by member: moving a whole OverlapAnswer whose members have just been written would stall the processor,
  // because it reads several members at once before their writes have reached the cache.
  return {std::move(runs_), std::move(triangles_), {}, count_, truncated_};
}

void add_objects(OverlapAnswer& answer, FoundObjects& found, const SceneAtTime& moment, const OverlapOptions& options) {
  const absl::Span<const FoundObject> objects = found.finish();
  answer.count += found.count();
  if (options.count_only == CountOnly::kYes) return;
  if (answer.runs.empty()) {
    answer.objects = objects;
    answer.truncated |= found.truncated();
    return;
  }
  if (objects.empty()) return;
  LowestRows rows(options.max_results, options.detail == StaticDetail::kTrianglesSorted);
  for (const RowRun& run : answer.runs) {
    if (run.triangle_count == 0)
      rows.offer(run.row);
    else
      rows.offer(run.row, answer.triangles_of(run));
  }
  for (const FoundObject& found_object : objects) rows.offer(hit_on(found_object.object, 0, moment));
  const bool truncated = answer.truncated || found.truncated();
  answer = rows.finish();
  answer.truncated |= truncated;
}

}  // namespace locus
