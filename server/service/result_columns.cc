#include "server/service/result_columns.h"

namespace locus::server {
namespace {

// Room that is written by somebody else before it is read.
template <class T>
T* grow(google::protobuf::RepeatedField<T>& column, size_t entries) {
  const int before = column.size();
  column.Reserve(before + static_cast<int>(entries));
  column.AddNAlreadyReserved(static_cast<int>(entries));
  return column.mutable_data() + before;
}

}  // namespace

ResultColumns::ResultColumns(v1::QueryResult& result, size_t blocks) : result_(result) {
  // Cleared blocks are used again by add_blocks().
  result.clear_blocks();
  for (size_t i = 0; i < blocks; ++i) result.add_blocks();
}

RowSpans ResultColumns::add_rows(size_t number, ColumnSet columns, size_t rows) {
  v1::BlockResult& to = block(number);
  RowSpans spans;
  if (columns.has(Column::kT)) spans.t = grow(*to.mutable_t(), rows);
  if (columns.has(Column::kId)) spans.ids = grow(*to.mutable_ids(), rows);
  if (columns.has(Column::kTriangle)) spans.triangles = grow(*to.mutable_triangles(), rows);
  if (columns.has(Column::kUv)) spans.uvs = grow(*to.mutable_uvs(), 2 * rows);
  if (columns.has(Column::kNormal)) spans.normals = grow(*to.mutable_normals(), 3 * rows);
  if (columns.has(Column::kPoint)) spans.points = grow(*to.mutable_points(), 3 * rows);
  if (columns.has(Column::kGroup)) spans.groups = grow(*to.mutable_groups(), rows);
  if (columns.has(Column::kTag)) spans.tags = grow(*to.mutable_tags(), rows);
  if (columns.has(Column::kLayers)) spans.layers = grow(*to.mutable_layers(), rows);
  if (columns.has(Column::kPose)) spans.positions = grow(*to.mutable_positions(), 3 * rows);
  if (columns.has(Column::kPose)) spans.rotations = grow(*to.mutable_rotations(), 4 * rows);
  return spans;
}

char* ResultColumns::add_hits(size_t number, size_t queries) {
  std::string& hits = *block(number).mutable_hits();
  hits.resize(hits.size() + queries);
  return hits.data() + (hits.size() - queries);
}

uint32_t* ResultColumns::add_counts(size_t number, size_t queries) {
  return grow(*block(number).mutable_counts(), queries);
}

uint32_t* ResultColumns::add_truncated(size_t number, size_t queries) {
  return grow(*block(number).mutable_truncated(), queries);
}

MomentSpans ResultColumns::add_moments(size_t number, size_t queries) {
  v1::BlockResult& to = block(number);
  return {grow(*to.mutable_resolved_ticks(), queries), grow(*to.mutable_resolved_fractions(), queries)};
}

uint32_t* ResultColumns::add_clamped(size_t number, size_t queries) {
  return grow(*block(number).mutable_clamped(), queries);
}

}  // namespace locus::server
