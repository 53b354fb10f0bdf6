#include <array>

#include "absl/strings/str_cat.h"
#include "core/base/limits.h"
#include "core/base/status_macros.h"
#include "server/convert/convert.h"
#include "server/convert/status.h"

namespace locus::server {
namespace {

// Tables from the number of a protocol enum to the core's value; number 0 maps to the default.
constexpr std::array kSources = {Source::kBoth, Source::kBoth, Source::kStatic, Source::kDynamic};
constexpr std::array kPrecisions = {Precision::kExact, Precision::kExact, Precision::kConservative};
constexpr std::array kRayModes = {RayMode::kFirst, RayMode::kFirst, RayMode::kAny, RayMode::kAll};
constexpr std::array kCulls = {Cull::kNone, Cull::kNone, Cull::kBack, Cull::kFront};
constexpr std::array kInsides = {Inside::kSolid, Inside::kSolid, Inside::kHollow, Inside::kSkip};
constexpr std::array kOutsides = {OutsideHistory::kReject, OutsideHistory::kReject, OutsideHistory::kClamp};
constexpr std::array kAtStarts = {AtStart::kHit, AtStart::kHit, AtStart::kApproach, AtStart::kPass};
constexpr std::array kClipDepths = {ClipDepth::kZeroToOne, ClipDepth::kZeroToOne, ClipDepth::kMinusOneToOne};
constexpr std::array kDetails = {StaticDetail::kInstances, StaticDetail::kInstances, StaticDetail::kTriangles,
                                 StaticDetail::kTrianglesSorted};

static_assert(kSources.size() == v1::Source_ARRAYSIZE && kPrecisions.size() == v1::Precision_ARRAYSIZE);
static_assert(kRayModes.size() == v1::RayMode_ARRAYSIZE && kCulls.size() == v1::Cull_ARRAYSIZE);
static_assert(kOutsides.size() == v1::OutsideHistory_ARRAYSIZE);
static_assert(kAtStarts.size() == v1::AtStart_ARRAYSIZE && kClipDepths.size() == v1::ClipDepth_ARRAYSIZE);
static_assert(kInsides.size() == v1::Inside_ARRAYSIZE && kDetails.size() == v1::StaticDetail_ARRAYSIZE);
static_assert(static_cast<int>(kLastColumn) == v1::COLUMN_SHAPE && v1::Column_ARRAYSIZE == v1::COLUMN_SHAPE + 1);

template <class T, size_t kCount>
absl::Status read_enum(int number, const std::array<T, kCount>& values, absl::string_view field, T* out) {
  if (number < 0 || static_cast<size_t>(number) >= kCount) return unknown_enum(field, number);
  *out = values[static_cast<size_t>(number)];
  return absl::OkStatus();
}

// Returns the columns after_ts, after_ids and after_triangles of rays or nearest queries. For each query they name a
// row; the answer omits this row and all rows before it.
template <class Kind>
AfterColumns after_of(const Kind& kind) {
  return {span_of(kind.after_ts()), span_of(kind.after_ids()), span_of(kind.after_triangles())};
}

absl::Status read_kind(const v1::Rays& rays, const std::string& field, QueryBlock* out) {
  RayColumns columns;
  columns.origins = span_of(rays.origins());
  columns.directions = span_of(rays.directions());
  columns.t_max = span_of(rays.t_max());
  columns.after = after_of(rays);
  absl::Status status = read_enum(rays.mode(), kRayModes, field + ".rays.mode", &columns.mode);
  if (status.ok()) status = read_enum(rays.cull(), kCulls, field + ".rays.cull", &columns.cull);
  if (status.ok()) status = read_enum(rays.inside(), kInsides, field + ".rays.inside", &columns.inside);
  out->kind = columns;
  return status;
}

absl::Status read_kind(const v1::Balls& balls, const std::string& field, QueryBlock* out) {
  BallColumns columns;
  columns.centers = span_of(balls.centers());
  columns.radii = span_of(balls.radii());
  const absl::Status status = read_enum(balls.detail(), kDetails, field + ".balls.detail", &columns.detail);
  out->kind = columns;
  return status;
}

absl::Status read_kind(const v1::Boxes& boxes, const std::string& field, QueryBlock* out) {
  BoxColumns columns;
  columns.centers = span_of(boxes.centers());
  columns.half_extents = span_of(boxes.half_extents());
  columns.rotations = span_of(boxes.rotations());
  const absl::Status status = read_enum(boxes.detail(), kDetails, field + ".boxes.detail", &columns.detail);
  out->kind = columns;
  return status;
}

absl::Status read_kind(const v1::Capsules& capsules, const std::string& field, QueryBlock* out) {
  CapsuleColumns columns;
  columns.starts = span_of(capsules.starts());
  columns.ends = span_of(capsules.ends());
  columns.radii = span_of(capsules.radii());
  const absl::Status status = read_enum(capsules.detail(), kDetails, field + ".capsules.detail", &columns.detail);
  out->kind = columns;
  return status;
}

absl::Status read_kind(const v1::Sweeps& sweeps, const std::string& field, QueryBlock* out) {
  SweepColumns columns;
  columns.starts = span_of(sweeps.starts());
  columns.ends = span_of(sweeps.ends());
  columns.radii = span_of(sweeps.radii());
  columns.half_axes = span_of(sweeps.half_axes());
  columns.half_extents = span_of(sweeps.half_extents());
  columns.rotations = span_of(sweeps.rotations());
  absl::Status status = read_enum(sweeps.mode(), kRayModes, field + ".sweeps.mode", &columns.mode);
  if (status.ok()) status = read_enum(sweeps.at_start(), kAtStarts, field + ".sweeps.at_start", &columns.at_start);
  out->kind = columns;
  return status;
}

absl::Status read_kind(const v1::Nearest& nearest, const std::string& field, QueryBlock* out) {
  NearestColumns columns;
  columns.points = span_of(nearest.points());
  columns.max_distances = span_of(nearest.max_distances());
  columns.count = nearest.k();
  columns.after = after_of(nearest);
  const absl::Status status = read_enum(nearest.detail(), kDetails, field + ".nearest.detail", &columns.detail);
  out->kind = columns;
  return status;
}

absl::Status read_kind(const v1::Frustums& frustums, const std::string& field, QueryBlock* out) {
  FrustumColumns columns;
  columns.planes = span_of(frustums.planes());
  columns.view_projections = span_of(frustums.view_projections());
  columns.planes_each = frustums.planes_each();
  absl::Status status =
      read_enum(frustums.clip_depth(), kClipDepths, field + ".frustums.clip_depth", &columns.clip_depth);
  if (status.ok()) status = read_enum(frustums.detail(), kDetails, field + ".frustums.detail", &columns.detail);
  out->kind = columns;
  return status;
}

absl::Status read_kind(const v1::Sight& sight, QueryBlock* out) {
  SightColumns columns;
  columns.viewers = span_of(sight.viewers());
  columns.viewer_groups = span_of(sight.viewer_groups());
  columns.targets = span_of(sight.targets());
  columns.target_groups = span_of(sight.target_groups());
  columns.max_distances = span_of(sight.max_distances());
  columns.samples = sight.samples_per_target();
  columns.eyes = sight.eyes_per_viewer();
  columns.pairwise = sight.pairwise();
  out->kind = columns;
  return absl::OkStatus();
}

absl::Status read_kind(const v1::Contains& contains, QueryBlock* out) {
  out->kind = ContainsColumns{span_of(contains.points())};
  return absl::OkStatus();
}

absl::Status read_kind(const v1::Pairs& pairs, QueryBlock* out) {
  out->kind =
      PairColumns{pairs.max_distance(), pairs.first_mask(), pairs.second_mask(), pairs.k(), pairs.after_other()};
  return absl::OkStatus();
}

absl::Status read_kind(const v1::Cells& cells, QueryBlock* out) {
  out->kind = CellColumns{span_of(cells.points()), span_of(cells.max_distances()), cells.max_planes()};
  return absl::OkStatus();
}

absl::Status read_kind(const v1::Lookup& lookup, const std::string& field, QueryBlock* out) {
  if (lookup.ids().empty() == lookup.groups().empty())
    return refuse_argument(Reason::kMalformed, field + ".lookup", {}, "give either ids or groups");
  out->kind = LookupColumns{span_of(lookup.ids()), span_of(lookup.groups())};
  return absl::OkStatus();
}

absl::Status read_kind(const v1::QueryBlock& block, const std::string& field, QueryBlock* out) {
  switch (block.kind_case()) {
    case v1::QueryBlock::kRays:
      return read_kind(block.rays(), field, out);
    case v1::QueryBlock::kBalls:
      return read_kind(block.balls(), field, out);
    case v1::QueryBlock::kBoxes:
      return read_kind(block.boxes(), field, out);
    case v1::QueryBlock::kLookup:
      return read_kind(block.lookup(), field, out);
    case v1::QueryBlock::kCapsules:
      return read_kind(block.capsules(), field, out);
    case v1::QueryBlock::kFrustums:
      return read_kind(block.frustums(), field, out);
    case v1::QueryBlock::kSweeps:
      return read_kind(block.sweeps(), field, out);
    case v1::QueryBlock::kNearest:
      return read_kind(block.nearest(), field, out);
    case v1::QueryBlock::kSight:
      return read_kind(block.sight(), out);
    case v1::QueryBlock::kContains:
      return read_kind(block.contains(), out);
    case v1::QueryBlock::kPairs:
      return read_kind(block.pairs(), out);
    case v1::QueryBlock::kCells:
      return read_kind(block.cells(), out);
    case v1::QueryBlock::KIND_NOT_SET:
      break;
  }
  return refuse_argument(Reason::kMalformed, field, {},
                         "a block needs one kind of query: rays, balls, boxes, capsules, frustums, contains, sweeps, "
                         "sight, nearest, pairs, cells or lookup");
}

absl::Status read_columns(const v1::QueryBlock& block, const std::string& field, ColumnSet* out) {
  for (int i = 0; i < block.columns_size(); ++i) {
    const int number = block.columns(i);
    if (number <= v1::COLUMN_UNSPECIFIED || number >= v1::Column_ARRAYSIZE)
      return refuse_argument(Reason::kMalformed, field + ".columns", static_cast<uint32_t>(i),
                             absl::StrCat("there is no column number ", number));
    out->add(static_cast<Column>(number));
  }
  return absl::OkStatus();
}

absl::Status read_block(const v1::QueryBlock& block, const std::string& field, QueryBlock* out) {
  RETURN_IF_ERROR(read_kind(block, field, out));
  RETURN_IF_ERROR(read_enum(block.source(), kSources, field + ".source", &out->source));
  RETURN_IF_ERROR(read_enum(block.precision(), kPrecisions, field + ".precision", &out->precision));
  RETURN_IF_ERROR(read_enum(block.outside_history(), kOutsides, field + ".outside_history", &out->outside));
  out->as_of_ticks = span_of(block.as_of_ticks());
  out->as_of_fractions = span_of(block.as_of_fractions());
  out->frame = to_vec(block.frame());
  out->masks = span_of(block.masks());
  out->ignore_groups = span_of(block.ignore_groups());
  out->ignore_ids = span_of(block.ignore_ids());
  out->only_groups = span_of(block.only_groups());
  out->only_groups_each = block.only_groups_each();
  out->tags = span_of(block.tags());
  out->tag_masks = span_of(block.tag_masks());
  out->self_ids = span_of(block.self_ids());
  out->max_results = block.max_results();
  out->after_id = block.after_id();
  out->anchor_ids = span_of(block.anchor_ids());
  out->count_only = block.count_only();
  out->rotation = span_of(block.rotation());
  return read_columns(block, field, &out->columns);
}

}  // namespace

absl::StatusOr<QueryBatch> to_queries(const v1::QueryBatch& batch) {
  if (static_cast<uint32_t>(batch.blocks_size()) > limits::kMaxBlocks)
    return refuse_limit("blocks", "blocks", limits::kMaxBlocks, batch.blocks_size());
  QueryBatch out;
  out.max_work = batch.max_work();
  out.max_reply_bytes = batch.max_reply_bytes();
  out.blocks.resize(static_cast<size_t>(batch.blocks_size()));
  for (int i = 0; i < batch.blocks_size(); ++i)
    RETURN_IF_ERROR(read_block(batch.blocks(i), absl::StrCat("blocks[", i, "]"), &out.blocks[static_cast<size_t>(i)]));
  return out;
}

v1::Work to_proto(const Work& work, uint64_t nanoseconds) {
  v1::Work out;
  out.set_nodes(work.nodes);
  out.set_cells(work.cells);
  out.set_tests(work.tests);
  out.set_nanoseconds(nanoseconds);
  return out;
}

}  // namespace locus::server
