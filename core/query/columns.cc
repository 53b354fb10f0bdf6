#include "core/query/columns.h"

#include "core/base/refusal.h"

namespace locus {
namespace {

// Upper bounds in bytes of the encoded field tags and lengths: kBlockOverhead for all columns of one block,
// kReplyOverhead for all fields of the reply outside its blocks.
constexpr uint64_t kBlockOverhead = 256;
constexpr uint64_t kReplyOverhead = 256;
// Upper bounds of encoded sizes for each query, in bytes: its row count, its index in the list of truncated queries,
// its index in the list of unanchored queries, and its effective time.
constexpr uint64_t kCountBytes = 4;
constexpr uint64_t kTruncatedBytes = 4;
constexpr uint64_t kAnchorBytes = 4;
constexpr uint64_t kTimeBytes = 16;  // tick, fraction, and the index of the query in the list of clamped queries

struct ServedColumns {
  ColumnSet operator()(const RayColumns& rays) const {
    if (rays.mode == RayMode::kAny) return {};
    return {Column::kT,     Column::kId,  Column::kTriangle, Column::kUv,   Column::kNormal, Column::kPoint,
            Column::kGroup, Column::kTag, Column::kLayers,   Column::kPose, Column::kShape};
  }
  ColumnSet operator()(const SweepColumns& sweeps) const {
    if (sweeps.mode == RayMode::kAny) return {};
    return {Column::kT,     Column::kId,  Column::kTriangle, Column::kNormal, Column::kPoint,
            Column::kGroup, Column::kTag, Column::kLayers,   Column::kPose,   Column::kShape};
  }
  ColumnSet operator()(const BallColumns&) const { return contact(); }
  ColumnSet operator()(const BoxColumns&) const { return contact(); }
  ColumnSet operator()(const CapsuleColumns&) const { return contact(); }
  ColumnSet operator()(const FrustumColumns&) const { return overlap(); }
  ColumnSet operator()(const SightColumns&) const { return {}; }
  ColumnSet operator()(const ContainsColumns&) const {
    return {Column::kId, Column::kGroup, Column::kTag, Column::kLayers, Column::kPose, Column::kShape};
  }
  ColumnSet operator()(const PairColumns&) const {
    return {Column::kT,   Column::kId,     Column::kOther, Column::kGroup,
            Column::kTag, Column::kLayers, Column::kPose,  Column::kShape};
  }
  ColumnSet operator()(const CellColumns&) const {
    return {Column::kT,     Column::kId,  Column::kTriangle, Column::kNormal, Column::kPoint,
            Column::kGroup, Column::kTag, Column::kLayers,   Column::kPose,   Column::kShape};
  }
  ColumnSet operator()(const NearestColumns&) const {
    return {Column::kT,     Column::kId,  Column::kTriangle, Column::kUv,   Column::kNormal, Column::kPoint,
            Column::kGroup, Column::kTag, Column::kLayers,   Column::kPose, Column::kShape};
  }
  ColumnSet operator()(const LookupColumns&) const {
    return {Column::kId, Column::kGroup, Column::kTag, Column::kLayers, Column::kPose, Column::kShape};
  }
  static ColumnSet contact() {
    ColumnSet columns = overlap();
    for (const Column column : {Column::kT, Column::kPoint, Column::kNormal}) columns.add(column);
    return columns;
  }
  static ColumnSet overlap() {
    return {Column::kId,     Column::kTriangle, Column::kGroup, Column::kTag,
            Column::kLayers, Column::kPose,     Column::kShape};
  }
};

struct DefaultColumns {
  ColumnSet operator()(const RayColumns& rays) const {
    if (rays.mode == RayMode::kAny) return {};
    return {Column::kT, Column::kId, Column::kTriangle};
  }
  ColumnSet operator()(const SweepColumns& sweeps) const {
    if (sweeps.mode == RayMode::kAny) return {};
    return {Column::kT, Column::kId, Column::kTriangle};
  }
  ColumnSet operator()(const BallColumns& balls) const { return overlap(balls.detail); }
  ColumnSet operator()(const BoxColumns& boxes) const { return overlap(boxes.detail); }
  ColumnSet operator()(const CapsuleColumns& capsules) const { return overlap(capsules.detail); }
  ColumnSet operator()(const FrustumColumns& frustums) const { return overlap(frustums.detail); }
  ColumnSet operator()(const SightColumns&) const { return {}; }
  ColumnSet operator()(const ContainsColumns&) const { return {Column::kId}; }
  ColumnSet operator()(const PairColumns& pairs) const {
    if (pairs.count == 0) return {Column::kId, Column::kOther};
    return {Column::kT, Column::kId, Column::kOther};
  }
  ColumnSet operator()(const CellColumns&) const {
    return {Column::kT, Column::kId, Column::kTriangle, Column::kNormal};
  }
  ColumnSet operator()(const NearestColumns&) const { return {Column::kT, Column::kId, Column::kTriangle}; }
  ColumnSet operator()(const LookupColumns&) const { return {Column::kId, Column::kPose}; }
  static ColumnSet overlap(StaticDetail detail) {
    if (detail == StaticDetail::kInstances) return {Column::kId};
    return {Column::kId, Column::kTriangle};
  }
};

struct LayoutOf {
  static RowLayout of_mode(RayMode mode) {
    return mode == RayMode::kFirst ? RowLayout::kDense
           : mode == RayMode::kAny ? RowLayout::kBytes
                                   : RowLayout::kCounted;
  }
  RowLayout operator()(const RayColumns& rays) const { return of_mode(rays.mode); }
  RowLayout operator()(const SweepColumns& sweeps) const { return of_mode(sweeps.mode); }
  RowLayout operator()(const BallColumns&) const { return RowLayout::kCounted; }
  RowLayout operator()(const BoxColumns&) const { return RowLayout::kCounted; }
  RowLayout operator()(const CapsuleColumns&) const { return RowLayout::kCounted; }
  RowLayout operator()(const FrustumColumns&) const { return RowLayout::kCounted; }
  RowLayout operator()(const SightColumns&) const { return RowLayout::kMatrix; }
  RowLayout operator()(const ContainsColumns&) const { return RowLayout::kCounted; }
  RowLayout operator()(const PairColumns&) const { return RowLayout::kCounted; }
  RowLayout operator()(const CellColumns&) const { return RowLayout::kCounted; }
  RowLayout operator()(const NearestColumns&) const { return RowLayout::kCounted; }
  RowLayout operator()(const LookupColumns& lookup) const {
    return lookup.groups.empty() ? RowLayout::kDense : RowLayout::kCounted;
  }
};

}  // namespace

ColumnSet served_columns(const QueryBlock& block) { return std::visit(ServedColumns(), block.kind); }

ColumnSet returned_columns(const QueryBlock& block) {
  if (block.count_only) return {};
  return block.columns.empty() ? std::visit(DefaultColumns(), block.kind) : block.columns;
}

RowLayout row_layout(const QueryBlock& block) { return std::visit(LayoutOf(), block.kind); }

size_t bytes_per_query(const QueryBlock& block) {
  const auto* const sight = std::get_if<SightColumns>(&block.kind);
  return sight == nullptr ? 1 : sight->bytes_per_viewer();
}

uint64_t max_rows_per_query(const QueryBlock& block) {
  if (const auto* const nearest = std::get_if<NearestColumns>(&block.kind)) return std::max(1u, nearest->count);
  if (const auto* const cells = std::get_if<CellColumns>(&block.kind))
    return 1 + (cells->max_planes == 0 ? limits::kDefaultCellPlanes : cells->max_planes);
  return block.max_results == 0 ? limits::kDefaultMaxResults : block.max_results;
}

uint64_t reply_limit(const QueryBatch& batch) {
  return batch.max_reply_bytes == 0 ? limits::kDefaultReplyBytes : batch.max_reply_bytes;
}

uint64_t fixed_reply_bytes(const QueryBatch& batch) {
  uint64_t bytes = kReplyOverhead;
  for (const QueryBlock& block : batch.blocks) {
    const RowLayout layout = row_layout(block);
    const uint64_t query_bytes = layout == RowLayout::kDense     ? row_bytes(returned_columns(block))
                                 : layout == RowLayout::kCounted ? kCountBytes
                                                                 : bytes_per_query(block);
    const uint64_t time_bytes = block.as_of_ticks.empty() ? 0 : kTimeBytes;
    const uint64_t anchor_bytes = block.anchor_ids.empty() ? 0 : kAnchorBytes;
    bytes += kBlockOverhead + query_count(block) * (query_bytes + kTruncatedBytes + time_bytes + anchor_bytes);
  }
  return bytes;
}

uint64_t max_encoded_reply_bytes(const QueryBatch& batch) {
  uint64_t bytes = fixed_reply_bytes(batch);
  for (const QueryBlock& block : batch.blocks) {
    if (row_layout(block) != RowLayout::kCounted) continue;
    bytes += query_count(block) * max_rows_per_query(block) * row_bytes(returned_columns(block));
  }
  return std::min(bytes, reply_limit(batch));
}

absl::Status check_reply_size(const QueryBatch& batch) {
  const uint64_t bytes = fixed_reply_bytes(batch);
  if (bytes <= reply_limit(batch)) return absl::OkStatus();
  return refuse_limit("max_reply_bytes", "max_reply_bytes", static_cast<double>(reply_limit(batch)),
                      static_cast<double>(bytes));
}

}  // namespace locus
