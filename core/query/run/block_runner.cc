#include "core/query/run/block_runner.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/geometry/sweep.h"
#include "core/query/frustum_planes.h"
#include "core/query/kinds/cell_query.h"
#include "core/query/kinds/contains_query.h"
#include "core/query/kinds/lookup_query.h"
#include "core/query/kinds/pair_query.h"
#include "core/query/kinds/ray_query.h"
#include "core/query/kinds/sight_query.h"
#include "core/query/kinds/sweep_query.h"
#include "core/query/run/rows.h"

namespace locus {
namespace {

// Work, in units of work_done(), after which a chunk is split. This work takes about 0.1 ms.
constexpr uint64_t kChunkWork = 16'384;
// Target work of one call of the ray kernels, in units of work_done(). The target is limited because a call cannot be
// interrupted.
constexpr uint64_t kCallWork = 65'536;
// Limits of the number of rays per call of the ray kernels. The maxima bound the duration of a call whose rays are
// unexpectedly expensive. With 4,096 triangle tests per ray, a call with the maximum number of rays takes 3 ms, or 6 ms
// in mode kAll, whose rays retain many hits. Twice as many rays per call would not be measurably faster.
constexpr uint64_t kMinRaysPerCall = 8, kMaxRaysPerCall = 128, kMaxRaysOfManyHits = 64;

}  // namespace

BlockRunner::BlockRunner(QueryTask& task, const QueryBlock& block, const QueryTimes& times, const QueryOrigins& origins,
                         BlockOutput& output, uint64_t max_bytes)
    : task_(task),
      block_(block),
      times_(times),
      origins_(origins),
      output_(output),
      columns_(returned_columns(block)),
      max_rows_(max_bytes / std::max(1u, row_bytes(columns_)) + 1) {
  const RowLayout layout = row_layout(block);
  LOCUS_DCHECK(layout == RowLayout::kDense || layout == RowLayout::kCounted || bytes_per_query(block) == 0 ||
               output.bytes != nullptr);
}

size_t BlockRunner::run(size_t begin, size_t end) {
  LOCUS_DCHECK_LT(begin, end);
  LOCUS_DCHECK_LE(end, query_count(block_));
  task_.check();
  const size_t reached = std::visit([&](const auto& kind) { return run_queries(kind, begin, end); }, block_.kind);
  task_.check();  // reports the work since the last check(), so that the budget also counts the work of small chunks
  LOCUS_DCHECK_LT(begin, reached);
  LOCUS_DCHECK_LE(reached, end);
  LOCUS_DCHECK_CALL(check_invariants(begin, reached));
  return reached;
}

void BlockRunner::check_invariants(size_t begin, size_t reached) const {
  LOCUS_DCHECK_LE(rows_, max_rows_);
  LOCUS_DCHECK_EQ(result_.counts.size(), row_layout(block_) == RowLayout::kCounted ? reached - begin : size_t{0});
  const std::vector<uint32_t>& cut = result_.truncated;
  for (size_t i = 1; i < cut.size(); ++i) LOCUS_DCHECK_LT(cut[i - 1], cut[i]);
  if (!cut.empty()) LOCUS_DCHECK(cut.front() >= begin && cut.back() < reached);
}

uint64_t BlockRunner::work_done() const {
  const Work& work = task_.work();
  return work.nodes + work.cells + work.tests + rows_;
}

bool BlockRunner::should_split() const { return work_done() >= kChunkWork && groups_.empty(); }

template <class Columns, class RegionOf>
void BlockRunner::walk_regions(const Columns& columns, size_t begin, size_t end, const RegionOf& region_of) {
  // A walk needs one search for every query, but an unanchored query (QueryOrigins::is_unanchored()) searches no
  // region.
  if (!origins_.unanchored().empty()) return;
  if (block_.source == Source::kStatic || !RegionWalk::pays(task_.snapshot().objects.grid())) return;
  const OverlapOptions options = overlap_options(block_, columns.detail);
  // Copies `region_of`: the walk calls the function during later queries, when the caller's function object no longer
  // exists.
  task_.walk_regions(begin, end, [region_of, options](size_t i) { return region_of(i, options); });
}

template <class Columns>
size_t BlockRunner::run_queries(const Columns& columns, size_t begin, size_t end) {
  if constexpr (std::is_same_v<Columns, BallColumns>)
    walk_regions(columns, begin, end, [&](size_t i, const OverlapOptions& options) {
      return ball_region(times_.of(i), ball_of(origins_.of(i), columns, i), options);
    });
  if constexpr (std::is_same_v<Columns, BoxColumns>)
    walk_regions(columns, begin, end, [&](size_t i, const OverlapOptions& options) {
      return box_region(times_.of(i), box_of(origins_.of(i), columns, i), options);
    });
  if constexpr (std::is_same_v<Columns, CapsuleColumns>)
    walk_regions(columns, begin, end, [&](size_t i, const OverlapOptions& options) {
      return capsule_region(times_.of(i), capsule_of(origins_.of(i), columns, i), options);
    });
  for (size_t i = begin; i < end; ++i) {
    if (i != begin && should_split()) return i;
    // After the end of the batch no search begins, but lookups are still answered: they need no search, except the one
    // that look_up_groups_at() may already have done for all groups of the block. With brute force they do search.
    const bool searches = !std::is_same_v<Columns, LookupColumns> || task_.brute_force();
    if (origins_.is_unanchored(i) || (searches && task_.ended()))
      write_nothing(i);
    else
      run_query(columns, i);
    if (task_.ended()) mark_truncated(i);
  }
  return end;
}

void BlockRunner::mark_truncated(size_t i) {
  const auto query = static_cast<uint32_t>(i);
  if (result_.truncated.empty() || result_.truncated.back() != query) result_.truncated.push_back(query);
}

size_t BlockRunner::run_queries(const SightColumns& sight, size_t begin, size_t end) {
  const size_t at_once = viewers_together(sight);
  if (at_once == 0) return run_queries<SightColumns>(sight, begin, end);
  const size_t bytes = sight.bytes_per_viewer();
  std::vector<SightQuery> queries;
  for (size_t first = begin; first < end; first += at_once) {
    if (first != begin && should_split()) return first;
    const size_t last = std::min(end, first + at_once);
    std::fill_n(output_.bytes + first * bytes, (last - first) * bytes, '\0');
    queries.clear();
    for (size_t i = first; i < last; ++i)
      if (!origins_.is_unanchored(i))
        queries.push_back({i, &times_.of(i), origins_.of(i), {output_.bytes + i * bytes, bytes}});
    if (!task_.ended()) look_together(task_, block_, sight, queries);
    for (size_t i = first; task_.ended() && i < last; ++i) mark_truncated(i);
  }
  return end;
}

// Writes the hits of query `i` to the columns `to`, beginning at row `row`. Computes the surface columns (uv, normal
// and point) only if the block returns one of them, which is rare.
template <class Columns>
void BlockRunner::write_hits(const Columns& columns, absl::Span<const Hit> hits, size_t i, const RowSpans& to,
                             size_t row) {
  for (size_t k = 0; k < hits.size(); ++k) write_row(hits[k], to, row + k);
  if (to.uvs != nullptr || to.normals != nullptr || to.points != nullptr) write_surfaces(columns, hits, i, to, row);
}

void BlockRunner::write_surfaces(const RayColumns& rays, absl::Span<const Hit> hits, size_t i, const RowSpans& to,
                                 size_t row) {
  if (hits.empty()) return;
  if (hits.front().id == kNoId) return write_no_surface(to, row);
  const Winding winding = task_.snapshot().winding;
  const RayRequest request = RayReader(block_, rays, origins_, winding).request(i);
  for (size_t k = 0; k < hits.size(); ++k) write_surface(request, block_.frame, hits[k], winding, to, row + k);
}

void BlockRunner::write_surfaces(const SweepColumns& sweeps, absl::Span<const Hit> hits, size_t i, const RowSpans& to,
                                 size_t row) {
  const SweepRequest request = sweep_request(block_, origins_.of(i), sweeps, i);
  for (size_t k = 0; k < hits.size(); ++k) write_contact(request, block_.frame, hits[k], to, row + k);
}

template <class Columns>
void BlockRunner::append_counted(const Columns& columns, const RayAnswer& answer, size_t i) {
  if (block_.count_only) return write_count(answer.count);
  const absl::Span<const Hit> hits = answer.hits;
  const size_t kept = std::min<uint64_t>(hits.size(), max_rows_ - rows_);
  write_hits(columns, hits.subspan(0, kept), i, add_rows(result_, columns_, kept), 0);
  count_rows(kept, answer.truncated || kept < hits.size(), i);
}

void BlockRunner::append_rows(const OverlapAnswer& answer, size_t i) {
  if (block_.count_only) return write_count(answer.count);
  if (answer.objects.empty()) return append_runs(answer, i);
  const size_t kept = std::min<uint64_t>(answer.objects.size(), max_rows_ - rows_);
  write_object_rows(answer.objects.subspan(0, kept), times_.of(i), add_rows(result_, columns_, kept));
  count_rows(kept, answer.truncated || kept < answer.objects.size(), i);
}

template <class Solid>
void BlockRunner::append_contacts(const OverlapAnswer& answer, const Solid& solid, size_t i) {
  const uint64_t before = rows_;
  append_rows(answer, i);
  const bool wanted = columns_.has(Column::kT) || columns_.has(Column::kNormal) || columns_.has(Column::kPoint);
  if (wanted && rows_ != before) write_contacts(answer, solid, i, rows_ - before);
}

// Writes the contacts of the last `rows` rows, which are the first rows of `answer`.
template <class Solid>
void BlockRunner::write_contacts(const OverlapAnswer& answer, const Solid& solid, size_t i, size_t rows) {
  const RowSpans to = last_rows(result_, columns_, rows);
  const Mover mover = resting(solid);
  size_t row = 0;
  const auto write = [&](const Hit& hit, uint32_t triangle) {
    if (row < rows) write_overlap_contact(mover, block_.precision, block_.frame, hit, triangle, to, row++);
  };
  for (const FoundObject& found : answer.objects) write(hit_on(found.object, 0, times_.of(i)), kNoTriangle);
  for (const RowRun& run : answer.runs) {
    for (const uint32_t triangle : answer.triangles_of(run)) write(run.row, triangle);
    if (run.triangle_count != 0 || row >= rows) continue;
    const bool searched = !run.row.object && block_.precision == Precision::kExact;
    write(run.row, searched ? nearest_overlapping(task_, solid, *run.row.instance) : kNoTriangle);
  }
}

void BlockRunner::append_runs(const OverlapAnswer& answer, size_t i) {
  size_t all = 0;
  for (const RowRun& run : answer.runs) all += run.rows();
  const size_t kept = std::min<uint64_t>(all, max_rows_ - rows_);
  const RowSpans to = add_rows(result_, columns_, kept);
  size_t row = 0;
  for (const RowRun& run : answer.runs) {
    const size_t rows = std::min(run.rows(), kept - row);
    if (run.triangle_count != 0)
      write_triangle_rows(run.row, answer.triangles_of(run).subspan(0, rows), to, row);
    else if (rows != 0)
      write_row(run.row, to, row);
    row += rows;
  }
  count_rows(kept, answer.truncated || kept < all, i);
}

void BlockRunner::count_rows(size_t rows, bool cut, size_t i) {
  rows_ += rows;
  LOCUS_DCHECK_LE(rows_, max_rows_);
  result_.counts.push_back(static_cast<uint32_t>(rows));
  if (cut) result_.truncated.push_back(static_cast<uint32_t>(i));
}

void BlockRunner::write_count(uint64_t rows) {
  LOCUS_DCHECK(block_.count_only);
  result_.counts.push_back(static_cast<uint32_t>(std::min<uint64_t>(rows, std::numeric_limits<uint32_t>::max())));
}

void BlockRunner::write_nothing(size_t i) {
  switch (row_layout(block_)) {
    case RowLayout::kDense:
      return write_miss(output_.rows, i);
    case RowLayout::kBytes:
    case RowLayout::kMatrix:
      std::fill_n(output_.bytes + i * bytes_per_query(block_), bytes_per_query(block_), '\0');
      return;
    case RowLayout::kCounted:
      result_.counts.push_back(0);
      return;
  }
}

size_t BlockRunner::run_queries(const RayColumns& rays, size_t begin, size_t end) {
  for (size_t first = begin; first < end;) {
    if (first != begin && should_split()) return first;
    const size_t last = std::min<size_t>(end, first + output_.rays_per_call.load(std::memory_order_relaxed));
    const uint64_t before = work_done();
    const RayAnswers answers = run_rays(task_, block_, rays, times_, origins_, task_.snapshot().winding, first, last);
    for (size_t i = first; i < last; ++i) write_answer(rays, answers[i - first], i);
    adapt_rays_per_call(last - first, work_done() - before);
    first = last;
  }
  return end;
}

// Sets the number of rays of the next kernel call so that the call needs about kCallWork, assuming the same work per
// ray as in the last call. The new number is at most 4 * rays.
void BlockRunner::adapt_rays_per_call(size_t rays, uint64_t work) {
  LOCUS_DCHECK_GT(rays, size_t{0});
  const bool many_hits = std::get<RayColumns>(block_.kind).mode == RayMode::kAll;
  const uint64_t max_rays = many_hits ? kMaxRaysOfManyHits : kMaxRaysPerCall;
  const uint64_t fit = kCallWork * rays / std::max<uint64_t>(work, 1);
  const uint64_t next = std::clamp<uint64_t>(std::min<uint64_t>(fit, 4 * rays), kMinRaysPerCall, max_rays);
  output_.rays_per_call.store(static_cast<uint32_t>(next), std::memory_order_relaxed);
}

template <class Columns>
void BlockRunner::write_answer(const Columns& columns, const RayAnswer& answer, size_t i) {
  if (columns.mode == RayMode::kAll) return append_counted(columns, answer, i);
  if (answer.truncated) result_.truncated.push_back(static_cast<uint32_t>(i));
  if (columns.mode == RayMode::kAny) {
    output_.bytes[i] = answer.hits.empty() ? '\0' : '\1';
    return;
  }
  static constexpr Hit kMiss;
  write_hits(columns, {answer.hits.empty() ? &kMiss : answer.hits.data(), 1}, i, output_.rows, i);
}

void BlockRunner::run_query(const SweepColumns& sweeps, size_t i) {
  const SweepRequest request = sweep_request(block_, origins_.of(i), sweeps, i);
  write_answer(sweeps, run_sweep(task_, times_.of(i), request, Filter(block_, i)), i);
}

void BlockRunner::run_query(const BallColumns& balls, size_t i) {
  const Balld ball = ball_of(origins_.of(i), balls, i);
  append_contacts(run_ball(task_, times_.of(i), ball, overlap_options(block_, balls.detail), Filter(block_, i)), ball,
                  i);
}

void BlockRunner::run_query(const BoxColumns& boxes, size_t i) {
  const Obbd box = box_of(origins_.of(i), boxes, i);
  append_contacts(run_box(task_, times_.of(i), box, overlap_options(block_, boxes.detail), Filter(block_, i)), box, i);
}

void BlockRunner::run_query(const CapsuleColumns& capsules, size_t i) {
  const Capsule capsule = capsule_of(origins_.of(i), capsules, i);
  append_contacts(
      run_capsule(task_, times_.of(i), capsule, overlap_options(block_, capsules.detail), Filter(block_, i)), capsule,
      i);
}

void BlockRunner::run_query(const NearestColumns& nearest, size_t i) {
  const NearestRequest request = nearest_request(block_, origins_.of(i), nearest, i);
  const NearestAnswer answer = run_nearest(task_, times_.of(i), request, Filter(block_, i));
  if (block_.count_only) return write_count(answer.count);
  const absl::Span<const Hit> rows = answer.rows;
  const size_t kept = std::min<uint64_t>(rows.size(), max_rows_ - rows_);
  const RowSpans to = add_rows(result_, columns_, kept);
  for (size_t row = 0; row < kept; ++row) {
    write_row(rows[row], to, row);
    write_nearest_surface(request, block_.frame, rows[row], task_.snapshot().winding, to, row);
  }
  count_rows(kept, kept < rows.size(), i);
}

void BlockRunner::run_query(const FrustumColumns& frustums, size_t i) {
  const std::optional<ConvexRegion> region = ConvexRegion::make(origins_.of(i), FrustumPlanes(frustums, i).planes());
  // A region that is relative to an anchor may lie outside of the world.
  if (!region) return write_nothing(i);
  append_rows(run_region(task_, times_.of(i), *region, overlap_options(block_, frustums.detail), Filter(block_, i)), i);
}

void BlockRunner::run_query(const SightColumns& sight, size_t i) {
  const size_t bytes = sight.bytes_per_viewer();
  char* const to = output_.bytes + i * bytes;
  std::fill_n(to, bytes, '\0');
  look(task_, times_.of(i), block_, sight, origins_.of(i), i, {to, bytes});
}

void BlockRunner::run_query(const ContainsColumns& contains, size_t i) {
  const Vec3d point = origins_.of(i) + read_vec3d(ColumnReader<float>(contains.points, 3).entry(i));
  const OverlapOptions options = overlap_options(block_, StaticDetail::kInstances);
  append_rows(run_contains(task_, times_.of(i), point, options, Filter(block_, i)), i);
}

void BlockRunner::run_query(const PairColumns& pairs, size_t i) {
  const PairAnswer answer = run_pairs(task_, times_.of(i), block_, pairs);
  if (block_.count_only) return write_count(answer.count);
  const size_t kept = std::min<uint64_t>(answer.rows.size(), max_rows_ - rows_);
  const RowSpans to = add_rows(result_, columns_, kept);
  for (size_t row = 0; row < kept; ++row) {
    write_row(answer.rows[row].first, to, row);
    if (to.others != nullptr) to.others[row] = answer.rows[row].other;
  }
  count_rows(kept, answer.truncated || kept < answer.rows.size(), i);
}

void BlockRunner::run_query(const CellColumns& cells, size_t i) {
  const CellRequest request = cell_request(block_, origins_.of(i), cells, i);
  const CellAnswer answer = run_cell(task_, times_.of(i), request, Filter(block_, i));
  const size_t rows = answer.is_free ? 1 + answer.planes.size() : 0;
  const size_t kept = std::min<uint64_t>(rows, max_rows_ - rows_);
  write_cell(answer, request.point - block_.frame, add_rows(result_, columns_, kept), kept);
  count_rows(kept, answer.truncated || kept < rows, i);
}

// Looks up all groups of the block at once, at the effective time of query `i`. Does nothing if the
// last lookup was at the same time, so that consecutive queries with equal times share one lookup.
void BlockRunner::look_up_groups_at(const LookupColumns& lookup, size_t i) {
  const bool same = groups_query_ && (!times_.asks_past() || times_.time(*groups_query_) == times_.time(i));
  if (same || task_.ended()) return;
  groups_query_ = i;
  groups_ = look_up_groups(task_, times_.of(i), lookup.groups, overlap_options(block_, StaticDetail::kInstances));
}

void BlockRunner::run_query(const LookupColumns& lookup, size_t i) {
  if (lookup.groups.empty()) return write_row(look_up(task_, times_.of(i), lookup.ids[i]), output_.rows, i);
  look_up_groups_at(lookup, i);
  const OverlapAnswer& answer = groups_[lookup.groups[i]];
  append_rows(answer, i);
}

}  // namespace locus
