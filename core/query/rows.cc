#include "core/query/rows.h"

#include <array>
#include <limits>

#include "core/base/refusal.h"

namespace locus {
namespace {

// Tags and lengths of every column of a block, and of a reply around its blocks, are shorter than this.
constexpr uint64_t kBlockOverhead = 256;
constexpr uint64_t kReplyOverhead = 256;
constexpr uint64_t kCountBytes = 4;
constexpr uint64_t kTruncatedBytes = 4;
constexpr uint64_t kMomentBytes = 16;  // its tick, its fraction, and whether it was clamped

constexpr std::array<absl::string_view, 11> kColumnNames = {"UNSPECIFIED", "T",     "ID",  "TRIANGLE", "UV",  "NORMAL",
                                                            "POINT",       "GROUP", "TAG", "LAYERS",   "POSE"};
// Encoded bytes a row, by column number.
constexpr std::array<uint32_t, 11> kColumnBytes = {0, 4, 8, 4, 8, 12, 12, 8, 8, 4, 40};

struct ServedColumns {
  ColumnSet operator()(const RayColumns& rays) const {
    if (rays.mode == RayMode::kAny) return {};
    return {Column::kT,     Column::kId,    Column::kTriangle, Column::kUv,     Column::kNormal,
            Column::kPoint, Column::kGroup, Column::kTag,      Column::kLayers, Column::kPose};
  }
  ColumnSet operator()(const BallColumns&) const { return overlap(); }
  ColumnSet operator()(const BoxColumns&) const { return overlap(); }
  ColumnSet operator()(const NearestColumns&) const {
    return {Column::kT,     Column::kId,  Column::kTriangle, Column::kPoint,
            Column::kGroup, Column::kTag, Column::kLayers,   Column::kPose};
  }
  ColumnSet operator()(const LookupColumns&) const {
    return {Column::kId, Column::kGroup, Column::kTag, Column::kLayers, Column::kPose};
  }
  static ColumnSet overlap() {
    return {Column::kId, Column::kTriangle, Column::kGroup, Column::kTag, Column::kLayers, Column::kPose};
  }
};

struct DefaultColumns {
  ColumnSet operator()(const RayColumns& rays) const {
    if (rays.mode == RayMode::kAny) return {};
    return {Column::kT, Column::kId, Column::kTriangle};
  }
  ColumnSet operator()(const BallColumns& balls) const { return overlap(balls.detail); }
  ColumnSet operator()(const BoxColumns& boxes) const { return overlap(boxes.detail); }
  ColumnSet operator()(const NearestColumns&) const { return {Column::kT, Column::kId, Column::kTriangle}; }
  ColumnSet operator()(const LookupColumns&) const { return {Column::kId, Column::kPose}; }
  static ColumnSet overlap(StaticDetail detail) {
    if (detail == StaticDetail::kInstances) return {Column::kId};
    return {Column::kId, Column::kTriangle};
  }
};

struct LayoutOf {
  RowLayout operator()(const RayColumns& rays) const {
    return rays.mode == RayMode::kFirst ? RowLayout::kDense
           : rays.mode == RayMode::kAny ? RowLayout::kBytes
                                        : RowLayout::kCounted;
  }
  RowLayout operator()(const BallColumns&) const { return RowLayout::kCounted; }
  RowLayout operator()(const BoxColumns&) const { return RowLayout::kCounted; }
  RowLayout operator()(const NearestColumns&) const { return RowLayout::kCounted; }
  RowLayout operator()(const LookupColumns& lookup) const {
    return lookup.groups.empty() ? RowLayout::kDense : RowLayout::kCounted;
  }
};

// What objects and instances have in common in a row.
struct Labels {
  Group group = 0;
  Tag tag = 0;
  Layers layers = 0;
  Vec3d position;
  Quaternion rotation{0, 0, 0, 0};
};

Labels labels_of(const Hit& hit) {
  if (hit.object) {
    const GridEntry& entry = hit.object.entry();
    const Shape shape = hit.object_shape();
    return {entry.group, entry.tag, entry.layers, shape.position, shape.rotation};
  }
  if (hit.instance != nullptr)
    return {hit.instance->group, hit.instance->tag, hit.instance->layers, hit.instance->transform.translation,
            hit.instance->transform.quaternion};
  return {};
}

template <class Values, class V>
void append_point(Values& values, V x, V y, V z) {
  values.insert(values.end(), {x, y, z});
}

template <class Values>
void append_slice(const Values& from, size_t first, size_t count, size_t width, Values& to) {
  const auto begin = from.begin() + static_cast<std::ptrdiff_t>(first * width);
  to.insert(to.end(), begin, begin + static_cast<std::ptrdiff_t>(count * width));
}

}  // namespace

absl::string_view column_name(Column column) { return kColumnNames[static_cast<size_t>(column)]; }

ColumnSet served_columns(const QueryBlock& block) { return std::visit(ServedColumns(), block.kind); }

ColumnSet returned_columns(const QueryBlock& block) {
  return block.columns.empty() ? std::visit(DefaultColumns(), block.kind) : block.columns;
}

RowLayout row_layout(const QueryBlock& block) { return std::visit(LayoutOf(), block.kind); }

uint32_t row_bytes(ColumnSet columns) {
  uint32_t bytes = 0;
  for (size_t number = 1; number < kColumnBytes.size(); ++number)
    if (columns.has(static_cast<Column>(number))) bytes += kColumnBytes[number];
  return bytes;
}

uint64_t reply_limit(const QueryBatch& batch) {
  return batch.max_reply_bytes == 0 ? limits::kDefaultReplyBytes : batch.max_reply_bytes;
}

uint64_t fixed_reply_bytes(const QueryBatch& batch) {
  uint64_t bytes = kReplyOverhead;
  for (const QueryBlock& block : batch.blocks) {
    const RowLayout layout = row_layout(block);
    const uint64_t a_query = layout == RowLayout::kDense   ? row_bytes(returned_columns(block))
                             : layout == RowLayout::kBytes ? 1
                                                           : kCountBytes;
    const uint64_t a_moment = block.as_of_ticks.empty() ? 0 : kMomentBytes;
    bytes += kBlockOverhead + query_count(block) * (a_query + kTruncatedBytes + a_moment);
  }
  return bytes;
}

absl::Status check_reply_size(const QueryBatch& batch) {
  const uint64_t bytes = fixed_reply_bytes(batch);
  if (bytes <= reply_limit(batch)) return absl::OkStatus();
  return refuse_limit("max_reply_bytes", "reply_bytes", static_cast<double>(reply_limit(batch)),
                      static_cast<double>(bytes));
}

void append_row(const Hit& hit, ColumnSet columns, BlockResult& result) {
  if (columns.has(Column::kT)) result.t.push_back(hit.t);
  if (columns.has(Column::kId)) result.ids.push_back(hit.id);
  if (columns.has(Column::kTriangle)) result.triangles.push_back(hit.triangle);
  if (!columns.has(Column::kGroup) && !columns.has(Column::kTag) && !columns.has(Column::kLayers) &&
      !columns.has(Column::kPose))
    return;
  const Labels labels = labels_of(hit);
  if (columns.has(Column::kGroup)) result.groups.push_back(labels.group);
  if (columns.has(Column::kTag)) result.tags.push_back(labels.tag);
  if (columns.has(Column::kLayers)) result.layers.push_back(labels.layers);
  if (!columns.has(Column::kPose)) return;
  append_point(result.positions, labels.position.x, labels.position.y, labels.position.z);
  append_point(result.rotations, labels.rotation.x, labels.rotation.y, labels.rotation.z);
  result.rotations.push_back(labels.rotation.w);
}

void append_triangle_rows(const Hit& hit, absl::Span<const uint32_t> triangles, ColumnSet columns,
                          BlockResult& result) {
  if (columns.has(Column::kId)) result.ids.insert(result.ids.end(), triangles.size(), hit.id);
  if (columns.has(Column::kTriangle))
    result.triangles.insert(result.triangles.end(), triangles.begin(), triangles.end());
  ColumnSet labels;
  for (const Column column : {Column::kGroup, Column::kTag, Column::kLayers, Column::kPose})
    if (columns.has(column)) labels.add(column);
  if (labels.empty()) return;
  for (size_t row = 0; row < triangles.size(); ++row) append_row(hit, labels, result);
}

void append_surface(const RayRequest& request, Vec3d frame, const Hit& hit, Winding winding, ColumnSet columns,
                    BlockResult& result) {
  if (columns.has(Column::kUv) || columns.has(Column::kNormal)) {
    const Surface surface = surface_at(request, hit, winding);
    if (columns.has(Column::kUv)) result.uvs.insert(result.uvs.end(), {surface.u, surface.v});
    const Vec3f normal = to_float(surface.normal);
    if (columns.has(Column::kNormal)) append_point(result.normals, normal.x, normal.y, normal.z);
  }
  if (!columns.has(Column::kPoint)) return;
  Vec3f point;
  if (hit.id != kNoId) point = to_float(request.origin - frame + request.direction * double{hit.t});
  append_point(result.points, point.x, point.y, point.z);
}

void append_nearest_point(const NearestRequest& request, Vec3d frame, const Hit& row, ColumnSet columns,
                          BlockResult& result) {
  if (!columns.has(Column::kPoint)) return;
  const Vec3f point = to_float(request.point - frame + nearest_offset(request, row));
  append_point(result.points, point.x, point.y, point.z);
}

void append_rows(const BlockResult& from, size_t first, size_t rows, ColumnSet columns, BlockResult& to) {
  if (columns.has(Column::kT)) append_slice(from.t, first, rows, 1, to.t);
  if (columns.has(Column::kId)) append_slice(from.ids, first, rows, 1, to.ids);
  if (columns.has(Column::kTriangle)) append_slice(from.triangles, first, rows, 1, to.triangles);
  if (columns.has(Column::kUv)) append_slice(from.uvs, first, rows, 2, to.uvs);
  if (columns.has(Column::kNormal)) append_slice(from.normals, first, rows, 3, to.normals);
  if (columns.has(Column::kPoint)) append_slice(from.points, first, rows, 3, to.points);
  if (columns.has(Column::kGroup)) append_slice(from.groups, first, rows, 1, to.groups);
  if (columns.has(Column::kTag)) append_slice(from.tags, first, rows, 1, to.tags);
  if (columns.has(Column::kLayers)) append_slice(from.layers, first, rows, 1, to.layers);
  if (columns.has(Column::kPose)) append_slice(from.positions, first, rows, 3, to.positions);
  if (columns.has(Column::kPose)) append_slice(from.rotations, first, rows, 4, to.rotations);
}

}  // namespace locus
