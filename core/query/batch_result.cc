#include "core/query/batch_result.h"

namespace locus {
namespace {

template <class Values>
auto* grow(Values& values, size_t entries) {
  values.resize(values.size() + entries);
  return values.data() + (values.size() - entries);
}

}  // namespace

RowSpans add_rows(BlockResult& result, ColumnSet columns, size_t rows) {
  RowSpans spans;
  if (columns.has(Column::kT)) spans.t = grow(result.t, rows);
  if (columns.has(Column::kId)) spans.ids = grow(result.ids, rows);
  if (columns.has(Column::kTriangle)) spans.triangles = grow(result.triangles, rows);
  if (columns.has(Column::kUv)) spans.uvs = grow(result.uvs, 2 * rows);
  if (columns.has(Column::kNormal)) spans.normals = grow(result.normals, 3 * rows);
  if (columns.has(Column::kPoint)) spans.points = grow(result.points, 3 * rows);
  if (columns.has(Column::kGroup)) spans.groups = grow(result.groups, rows);
  if (columns.has(Column::kTag)) spans.tags = grow(result.tags, rows);
  if (columns.has(Column::kLayers)) spans.layers = grow(result.layers, rows);
  if (columns.has(Column::kPose)) spans.positions = grow(result.positions, 3 * rows);
  if (columns.has(Column::kPose)) spans.rotations = grow(result.rotations, 4 * rows);
  return spans;
}

RowSpans BatchResultSink::add_rows(size_t block, ColumnSet columns, size_t rows) {
  return locus::add_rows(result_.blocks[block], columns, rows);
}
char* BatchResultSink::add_hits(size_t block, size_t queries) { return grow(result_.blocks[block].hits, queries); }
uint32_t* BatchResultSink::add_counts(size_t block, size_t queries) {
  return grow(result_.blocks[block].counts, queries);
}
uint32_t* BatchResultSink::add_truncated(size_t block, size_t queries) {
  return grow(result_.blocks[block].truncated, queries);
}
MomentSpans BatchResultSink::add_moments(size_t block, size_t queries) {
  BlockResult& result = result_.blocks[block];
  return {grow(result.resolved_ticks, queries), grow(result.resolved_fractions, queries)};
}
uint32_t* BatchResultSink::add_clamped(size_t block, size_t queries) {
  return grow(result_.blocks[block].clamped, queries);
}

}  // namespace locus
