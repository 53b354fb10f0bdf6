#include "core/query/rows.h"

#include <algorithm>
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

template <class T, class V>
void write_point(T* column, size_t row, V x, V y, V z) {
  column += 3 * row;
  column[0] = x;
  column[1] = y;
  column[2] = z;
}

void write_labels(const Hit& hit, const RowSpans& to, size_t row) {
  const Labels labels = labels_of(hit);
  if (to.groups != nullptr) to.groups[row] = labels.group;
  if (to.tags != nullptr) to.tags[row] = labels.tag;
  if (to.layers != nullptr) to.layers[row] = labels.layers;
  if (to.positions == nullptr) return;
  write_point(to.positions, row, labels.position.x, labels.position.y, labels.position.z);
  const Quaternion& turned = labels.rotation;
  std::copy_n(std::array{turned.x, turned.y, turned.z, turned.w}.begin(), 4, to.rotations + 4 * row);
}

bool has_labels(const RowSpans& to) {
  return to.groups != nullptr || to.tags != nullptr || to.layers != nullptr || to.positions != nullptr;
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

void write_row(const Hit& hit, const RowSpans& to, size_t row) {
  if (to.t != nullptr) to.t[row] = hit.t;
  if (to.ids != nullptr) to.ids[row] = hit.id;
  if (to.triangles != nullptr) to.triangles[row] = hit.triangle;
  if (has_labels(to)) write_labels(hit, to, row);
}

void write_triangle_rows(const Hit& hit, absl::Span<const uint32_t> triangles, const RowSpans& to, size_t row) {
  if (to.ids != nullptr) std::fill_n(to.ids + row, triangles.size(), hit.id);
  if (to.triangles != nullptr) std::copy(triangles.begin(), triangles.end(), to.triangles + row);
  if (!has_labels(to)) return;
  for (size_t i = 0; i < triangles.size(); ++i) write_labels(hit, to, row + i);
}

void write_object_rows(absl::Span<const FoundObject> objects, const Moment& moment, const RowSpans& to) {
  if (to.ids != nullptr)
    for (size_t row = 0; row < objects.size(); ++row) to.ids[row] = objects[row].id;
  if (to.triangles != nullptr) std::fill_n(to.triangles, objects.size(), kNoTriangle);
  if (!has_labels(to)) return;
  for (size_t row = 0; row < objects.size(); ++row) write_labels(hit_on(objects[row].object, 0, moment), to, row);
}

void write_surface(const RayRequest& request, Vec3d frame, const Hit& hit, Winding winding, const RowSpans& to,
                   size_t row) {
  if (to.uvs != nullptr || to.normals != nullptr) {
    const Surface surface = surface_at(request, hit, winding);
    if (to.uvs != nullptr) std::copy_n(std::array{surface.u, surface.v}.begin(), 2, to.uvs + 2 * row);
    const Vec3f normal = to_float(surface.normal);
    if (to.normals != nullptr) write_point(to.normals, row, normal.x, normal.y, normal.z);
  }
  if (to.points == nullptr) return;
  Vec3f point;
  if (hit.id != kNoId) point = to_float(request.origin - frame + request.direction * double{hit.t});
  write_point(to.points, row, point.x, point.y, point.z);
}

void write_nearest_point(const NearestRequest& request, Vec3d frame, const Hit& hit, const RowSpans& to, size_t row) {
  if (to.points == nullptr) return;
  const Vec3f point = to_float(request.point - frame + nearest_offset(request, hit));
  write_point(to.points, row, point.x, point.y, point.z);
}

}  // namespace locus
