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
  ++answer_.count;
  if (count_only_ == CountOnly::kYes) return;
  answer_.runs.push_back({row});
  ++rows_;
  if (rows_ > 2 * max_results_) keep_lowest();
  LOCUS_DCHECK_CALL(check_invariants());
}

void LowestRows::offer(const Hit& row, absl::Span<const uint32_t> triangles) {
  LOCUS_DCHECK_NE(row.id, kNoId);
  if (triangles.empty()) return;
  answer_.count += triangles.size();
  if (count_only_ == CountOnly::kYes) return;
  if (answer_.runs.empty() || answer_.runs.back().row.id != row.id)
    answer_.runs.push_back({row, answer_.triangles.size(), 0});
  answer_.runs.back().triangle_count += triangles.size();
  answer_.triangles.insert(answer_.triangles.end(), triangles.begin(), triangles.end());
  rows_ += triangles.size();
  if (rows_ > 2 * max_results_) keep_lowest();
  LOCUS_DCHECK_CALL(check_invariants());
}

void LowestRows::check_invariants() const {
  LOCUS_DCHECK_LE(rows_, 2 * max_results_);
  LOCUS_DCHECK_LE(answer_.runs.size(), rows_);
  LOCUS_DCHECK_LE(answer_.triangles.size(), rows_);
  if (answer_.runs.empty() || answer_.runs.back().triangle_count == 0) return;
  LOCUS_DCHECK_EQ(answer_.runs.back().first_triangle + answer_.runs.back().triangle_count, answer_.triangles.size());
}

void LowestRows::check_runs() const {
  LOCUS_DCHECK_LE(rows_, max_results_);
  LOCUS_DCHECK(std::is_sorted(answer_.runs.begin(), answer_.runs.end(), lower_run_id));
  size_t rows = 0, triangles = 0;
  for (const RowRun& run : answer_.runs) {
    if (run.triangle_count != 0) LOCUS_DCHECK_EQ(run.first_triangle, triangles);
    triangles += run.triangle_count;
    rows += run.rows();
  }
  LOCUS_DCHECK_EQ(rows, rows_);
  LOCUS_DCHECK_EQ(triangles, answer_.triangles.size());
}

bool LowestRows::in_order() const {
  return !sorted_triangles_ && std::is_sorted(answer_.runs.begin(), answer_.runs.end(), lower_run_id);
}

void LowestRows::keep_lowest() {
  if (rows_ <= max_results_ && in_order()) return;
  const OverlapAnswer all =
      std::exchange(answer_, {{}, {}, {}, answer_.count, answer_.truncated || rows_ > max_results_});
  std::vector<RowRun> runs = all.runs;
  // An instance may have two runs: a run that an earlier call of keep_lowest() made, and a run with the triangles that
  // were added after that call. The stable sort preserves their order.
  std::stable_sort(runs.begin(), runs.end(), lower_run_id);
  rows_ = 0;
  for (size_t i = 0; i < runs.size() && rows_ < max_results_;) {
    RowRun& kept = answer_.runs.emplace_back(runs[i]);
    const size_t first = kept.first_triangle = answer_.triangles.size();
    for (; i < runs.size() && runs[i].row.id == kept.row.id; ++i) {
      const absl::Span<const uint32_t> triangles = all.triangles_of(runs[i]);
      answer_.triangles.insert(answer_.triangles.end(), triangles.begin(), triangles.end());
    }
    const auto begin = answer_.triangles.begin() + static_cast<std::ptrdiff_t>(first);
    if (sorted_triangles_) std::sort(begin, answer_.triangles.end());
    kept.triangle_count = std::min(answer_.triangles.size() - first, max_results_ - rows_);
    answer_.triangles.resize(first + kept.triangle_count);
    rows_ += kept.rows();
  }
}

OverlapAnswer LowestRows::finish() {
  keep_lowest();
  LOCUS_DCHECK_CALL(check_runs());
  return std::move(answer_);
}

}  // namespace locus
