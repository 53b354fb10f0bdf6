#include "core/query/query_batch.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/column.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "core/geometry/rotation.h"
#include "core/query/columns.h"
#include "core/query/frustum_planes.h"

namespace locus {
namespace {

// Validation of one block. Every error names the invalid field, such as blocks[2].rays.directions.
class BlockCheck {
 public:
  BlockCheck(const QueryBlock& block, size_t index) : block_(block), index_(index) {}

  absl::Status run() {
    n_ = query_count(block_);
    RETURN_IF_ERROR(check_common());
    RETURN_IF_ERROR(check_columns_of_kind());
    RETURN_IF_ERROR(check_anchors());
    RETURN_IF_ERROR(check_rotation());
    if (block_.count_only && (row_layout(block_) != RowLayout::kCounted || block_kind(block_) == BlockKind::kCell))
      return refuse_argument(Reason::kMalformed, name("count_only"), {}, "this kind of query has no counts");
    return std::visit([this](const auto& kind) { return check_kind(kind); }, block_.kind);
  }

 private:
  std::string name(absl::string_view field) const { return ColumnName{"blocks", index_, field}.text(); }

  absl::Status check_common() const {
    if (!is_finite(block_.frame))
      return refuse_argument(Reason::kNotFinite, name("frame"), {}, "a frame needs finite numbers");
    if (max_component(abs(block_.frame)) > limits::kMaxCoordinate)
      return refuse_argument(Reason::kOutOfRange, name("frame"), {}, "frames must lie within +-1e9");
    if (block_.ignore_ids.size() > limits::kMaxIgnoredIds)
      return refuse_limit(name("ignore_ids"), "ignored_ids", limits::kMaxIgnoredIds,
                          static_cast<double>(block_.ignore_ids.size()));
    if (block_.max_results > limits::kMaxMaxResults)
      return refuse_limit(name("max_results"), "max_results", limits::kMaxMaxResults, block_.max_results);
    RETURN_IF_ERROR(check_length(block_.masks.size(), 1, ColumnNeed::kOptional, "masks"));
    RETURN_IF_ERROR(check_length(block_.ignore_groups.size(), 1, ColumnNeed::kOptional, "ignore_groups"));
    RETURN_IF_ERROR(check_filters());
    return check_as_of();
  }

  absl::Status check_filters() const {
    if (block_.only_groups_each > limits::kMaxOnlyGroups)
      return refuse_limit(name("only_groups_each"), "only_groups", limits::kMaxOnlyGroups, block_.only_groups_each);
    RETURN_IF_ERROR(
        check_length(block_.only_groups.size(), block_.only_groups_per_query(), ColumnNeed::kOptional, "only_groups"));
    RETURN_IF_ERROR(check_length(block_.tags.size(), 1, ColumnNeed::kOptional, "tags"));
    RETURN_IF_ERROR(check_length(block_.tag_masks.size(), 1, ColumnNeed::kOptional, "tag_masks"));
    if (!block_.tag_masks.empty() && block_.tags.empty())
      return refuse_argument(Reason::kMalformed, name("tag_masks"), {}, "need tags: give both columns, or only tags");
    return check_length(block_.self_ids.size(), 1, ColumnNeed::kOptional, "self_ids");
  }

  absl::Status check_as_of() const {
    const absl::Span<const float> fractions = block_.as_of_fractions;
    RETURN_IF_ERROR(check_length(block_.as_of_ticks.size(), 1, ColumnNeed::kOptional, "as_of_ticks"));
    RETURN_IF_ERROR(check_length(fractions.size(), 1, ColumnNeed::kOptional, "as_of_fractions"));
    if (!fractions.empty() && block_.as_of_ticks.empty())
      return refuse_argument(Reason::kMalformed, name("as_of_fractions"), {},
                             "need as_of_ticks: give both columns, or neither");
    for (size_t i = 0; i < fractions.size(); ++i) {
      if (!std::isfinite(fractions[i])) return wrong(Reason::kNotFinite, "as_of_fractions", i, "needs finite numbers");
      if (fractions[i] < 0 || fractions[i] >= 1)
        return wrong(Reason::kOutOfRange, "as_of_fractions", i, "must be at least 0 and below 1");
    }
    return absl::OkStatus();
  }

  absl::Status check_anchors() const {
    const absl::Span<const uint64_t> anchors = block_.anchor_ids;
    if (anchors.empty()) return absl::OkStatus();
    const BlockKind kind = block_kind(block_);
    if (kind == BlockKind::kLookup || kind == BlockKind::kPairs)
      return refuse_argument(Reason::kMalformed, name("anchor_ids"), {}, "this kind of query has no positions");
    RETURN_IF_ERROR(check_length(anchors.size(), 1, ColumnNeed::kEachOrOne, "anchor_ids"));
    for (size_t i = 0; i < anchors.size(); ++i)
      if (anchors[i] == kNoId) return wrong(Reason::kOutOfRange, "anchor_ids", i, "0 is not an id");
    return absl::OkStatus();
  }

  absl::Status check_rotation() const {
    if (block_.rotation.empty()) return absl::OkStatus();
    if (block_kind(block_) != BlockKind::kRay)
      return refuse_argument(Reason::kMalformed, name("rotation"), {}, "only rays have directions to rotate");
    RETURN_IF_ERROR(check_column(block_.rotation.size(), 4, 1, ColumnNeed::kOptional, {"blocks", index_, "rotation"}));
    return check_rotations(block_.rotation, "rotation");
  }

  // Checks the columns of `after`, which give each query's position in the order of rows. `kind` is the name of the
  // block's kind in field names, such as rays.
  absl::Status check_after(const AfterColumns& after, const char* kind) const {
    const auto field = [kind](absl::string_view column) { return absl::StrCat(kind, ".", column); };
    if (after.ts.empty() && after.ids.empty() && after.triangles.empty()) return absl::OkStatus();
    RETURN_IF_ERROR(check_length(after.ts.size(), 1, ColumnNeed::kOptional, field("after_ts")));
    RETURN_IF_ERROR(check_length(after.ids.size(), 1, ColumnNeed::kOptional, field("after_ids")));
    RETURN_IF_ERROR(check_length(after.triangles.size(), 1, ColumnNeed::kOptional, field("after_triangles")));
    if (after.ts.empty() && !after.ids.empty())
      return refuse_argument(Reason::kMalformed, name(field("after_ids")), {}, "need after_ts");
    if (after.ids.empty() && !after.triangles.empty())
      return refuse_argument(Reason::kMalformed, name(field("after_triangles")), {}, "need after_ids");
    for (size_t i = 0; i < after.ts.size(); ++i)
      if (std::isnan(after.ts[i])) return wrong(Reason::kNotFinite, field("after_ts"), i, "must be a number");
    return absl::OkStatus();
  }

  absl::Status check_columns_of_kind() const {
    const ColumnSet served = served_columns(block_);
    for (int value = 1; value <= static_cast<int>(kLastColumn); ++value)
      if (const auto column = static_cast<Column>(value); block_.columns.has(column) && !served.has(column))
        return refuse_argument(Reason::kMalformed, name("columns"), {},
                               absl::StrCat(column_name(column), " is not a column of this kind of query"));
    return absl::OkStatus();
  }

  absl::Status check_length(size_t values, size_t width, ColumnNeed need, absl::string_view field) const {
    return check_column(values, width, n_, need, {"blocks", index_, field});
  }

  // Returns whether all points, given relative to origin(), lie within the world: |coordinate| <= kMaxCoordinate. The
  // loop has no branch per value, because nearly all batches are valid. Only if this function returns false,
  // check_points_from() searches for the invalid point.
  bool all_within_world(absl::Span<const float> values) const {
    const Vec3d from = origin();
    const auto within = [](double value) { return std::abs(value) <= limits::kMaxCoordinate; };
    bool all = values.size() % 3 == 0;
    for (size_t i = 0; i + 2 < values.size(); i += 3) {
      all &= within(from.x + double{values[i]});
      all &= within(from.y + double{values[i + 1]});
      all &= within(from.z + double{values[i + 2]});
    }
    return all;
  }
  // Returns the point to which positions are relative. Returns the world's origin if the block has anchors: their
  // positions are not known here, so only the offsets from the anchors are checked.
  Vec3d origin() const { return block_.anchor_ids.empty() ? block_.frame : Vec3d{}; }

  // Checks that points, given relative to the frame or an anchor, are finite and lie within the world. A query has
  // `points_each` points.
  absl::Status check_points(absl::Span<const float> values, absl::string_view field, size_t points_each = 1) const {
    return check_points_from(origin(), values, field, points_each);
  }
  absl::Status check_points_from(Vec3d origin, absl::Span<const float> values, absl::string_view field,
                                 size_t points_each) const {
    if (origin == this->origin() && all_within_world(values)) return absl::OkStatus();
    for (size_t i = 0; i < values.size(); ++i) {
      const size_t query = i / (3 * points_each);
      if (!std::isfinite(values[i])) return wrong(Reason::kNotFinite, field, query, "needs finite numbers");
      const double world = origin[static_cast<int>(i % 3)] + double{values[i]};
      if (std::abs(world) > limits::kMaxCoordinate)
        return wrong(Reason::kOutOfRange, field, query, "must lie within +-1e9 in the world");
    }
    return absl::OkStatus();
  }

  // Checks that lengths are finite, not negative, and at most limits::kMaxCoordinate.
  absl::Status check_sizes(absl::Span<const float> values, size_t width, absl::string_view field) const {
    for (size_t i = 0; i < values.size(); ++i) {
      if (!std::isfinite(values[i])) return wrong(Reason::kNotFinite, field, i / width, "needs finite numbers");
      if (values[i] < 0 || values[i] > limits::kMaxCoordinate)
        return wrong(Reason::kOutOfRange, field, i / width, "must lie between 0 and 1e9");
    }
    return absl::OkStatus();
  }

  // Checks that limits of distances are not negative and not NaN. Infinity is allowed.
  absl::Status check_distance_limits(absl::Span<const float> values, absl::string_view field) const {
    bool all = true;
    for (const float value : values) all &= value >= 0;
    if (all) return absl::OkStatus();
    for (size_t i = 0; i < values.size(); ++i) {
      if (std::isnan(values[i])) return wrong(Reason::kNotFinite, field, i, "must be a number");
      if (values[i] < 0) return wrong(Reason::kOutOfRange, field, i, "must not be negative");
    }
    return absl::OkStatus();
  }

  absl::Status wrong(Reason reason, absl::string_view field, size_t index, absl::string_view message) const {
    return refuse_argument(reason, name(field), static_cast<uint32_t>(index), message);
  }

  // Returns whether all directions are finite and not zero. Has no branches per value, like all_within_world().
  static bool all_directions_valid(absl::Span<const float> values) {
    constexpr float kMaxFloat = std::numeric_limits<float>::max();
    bool all = true;
    for (size_t i = 0; i + 2 < values.size(); i += 3) {
      const float x = std::abs(values[i]), y = std::abs(values[i + 1]), z = std::abs(values[i + 2]);
      all &= (x <= kMaxFloat) & (y <= kMaxFloat) & (z <= kMaxFloat) & ((x > 0) | (y > 0) | (z > 0));
    }
    return all;
  }

  absl::Status check_directions(absl::Span<const float> values) const {
    if (all_directions_valid(values)) return absl::OkStatus();
    for (size_t i = 0; i + 2 < values.size(); i += 3) {
      const Vec3f direction{values[i], values[i + 1], values[i + 2]};
      if (!is_finite(direction)) return wrong(Reason::kNotFinite, "rays.directions", i / 3, "needs finite numbers");
      if (direction == Vec3f{}) return wrong(Reason::kOutOfRange, "rays.directions", i / 3, "must not be zero");
    }
    return absl::OkStatus();
  }

  absl::Status check_kind(const RayColumns& rays) const {
    RETURN_IF_ERROR(check_length(rays.origins.size(), 3, ColumnNeed::kEachOrOne, "rays.origins"));
    RETURN_IF_ERROR(check_length(rays.directions.size(), 3, ColumnNeed::kEachOrOne, "rays.directions"));
    RETURN_IF_ERROR(check_length(rays.t_max.size(), 1, ColumnNeed::kOptional, "rays.t_max"));
    RETURN_IF_ERROR(check_points(rays.origins, "rays.origins"));
    RETURN_IF_ERROR(check_distance_limits(rays.t_max, "rays.t_max"));
    RETURN_IF_ERROR(check_after(rays.after, "rays"));
    return check_directions(rays.directions);
  }

  absl::Status check_kind(const BallColumns& balls) const {
    RETURN_IF_ERROR(check_length(balls.centers.size(), 3, ColumnNeed::kEach, "balls.centers"));
    RETURN_IF_ERROR(check_length(balls.radii.size(), 1, ColumnNeed::kEachOrOne, "balls.radii"));
    RETURN_IF_ERROR(check_points(balls.centers, "balls.centers"));
    return check_sizes(balls.radii, 1, "balls.radii");
  }

  absl::Status check_kind(const BoxColumns& boxes) const {
    RETURN_IF_ERROR(check_length(boxes.centers.size(), 3, ColumnNeed::kEach, "boxes.centers"));
    RETURN_IF_ERROR(check_length(boxes.half_extents.size(), 3, ColumnNeed::kEachOrOne, "boxes.half_extents"));
    RETURN_IF_ERROR(check_length(boxes.rotations.size(), 4, ColumnNeed::kOptional, "boxes.rotations"));
    RETURN_IF_ERROR(check_points(boxes.centers, "boxes.centers"));
    RETURN_IF_ERROR(check_sizes(boxes.half_extents, 3, "boxes.half_extents"));
    return check_rotations(boxes.rotations, "boxes.rotations");
  }

  absl::Status check_kind(const CapsuleColumns& capsules) const {
    RETURN_IF_ERROR(check_length(capsules.starts.size(), 3, ColumnNeed::kEach, "capsules.starts"));
    RETURN_IF_ERROR(check_length(capsules.ends.size(), 3, ColumnNeed::kEachOrOne, "capsules.ends"));
    RETURN_IF_ERROR(check_length(capsules.radii.size(), 1, ColumnNeed::kEachOrOne, "capsules.radii"));
    RETURN_IF_ERROR(check_points(capsules.starts, "capsules.starts"));
    RETURN_IF_ERROR(check_points(capsules.ends, "capsules.ends"));
    return check_sizes(capsules.radii, 1, "capsules.radii");
  }

  absl::Status check_kind(const SweepColumns& sweeps) const {
    RETURN_IF_ERROR(check_length(sweeps.starts.size(), 3, ColumnNeed::kEach, "sweeps.starts"));
    RETURN_IF_ERROR(check_length(sweeps.ends.size(), 3, ColumnNeed::kEachOrOne, "sweeps.ends"));
    RETURN_IF_ERROR(check_points(sweeps.starts, "sweeps.starts"));
    RETURN_IF_ERROR(check_points(sweeps.ends, "sweeps.ends"));
    return sweeps.half_extents.empty() ? check_round_movers(sweeps) : check_box_movers(sweeps);
  }

  absl::Status check_round_movers(const SweepColumns& sweeps) const {
    if (!sweeps.rotations.empty())
      return refuse_argument(Reason::kMalformed, name("sweeps.rotations"), {}, "need half_extents: only boxes turn");
    RETURN_IF_ERROR(check_length(sweeps.radii.size(), 1, ColumnNeed::kEachOrOne, "sweeps.radii"));
    RETURN_IF_ERROR(check_length(sweeps.half_axes.size(), 3, ColumnNeed::kOptional, "sweeps.half_axes"));
    RETURN_IF_ERROR(check_sizes(sweeps.radii, 1, "sweeps.radii"));
    for (size_t i = 0; i < sweeps.radii.size(); ++i)
      if (sweeps.radii[i] == 0)
        return wrong(Reason::kOutOfRange, "sweeps.radii", i, "must not be 0: ask rays for moving points");
    for (size_t i = 0; i < sweeps.half_axes.size(); ++i) {
      const float value = sweeps.half_axes[i];
      if (!std::isfinite(value)) return wrong(Reason::kNotFinite, "sweeps.half_axes", i / 3, "needs finite numbers");
      if (std::abs(value) > limits::kMaxCoordinate)
        return wrong(Reason::kOutOfRange, "sweeps.half_axes", i / 3, "must lie within +-1e9");
    }
    return absl::OkStatus();
  }

  absl::Status check_box_movers(const SweepColumns& sweeps) const {
    for (const auto& [values, field] :
         {std::pair{sweeps.radii, "sweeps.radii"}, {sweeps.half_axes, "sweeps.half_axes"}})
      if (!values.empty())
        return refuse_argument(Reason::kMalformed, name(field), {}, "must be absent if half_extents are given");
    RETURN_IF_ERROR(check_length(sweeps.half_extents.size(), 3, ColumnNeed::kEachOrOne, "sweeps.half_extents"));
    RETURN_IF_ERROR(check_length(sweeps.rotations.size(), 4, ColumnNeed::kOptional, "sweeps.rotations"));
    RETURN_IF_ERROR(check_sizes(sweeps.half_extents, 3, "sweeps.half_extents"));
    for (size_t i = 0; i + 2 < sweeps.half_extents.size(); i += 3)
      if (sweeps.half_extents[i] == 0 && sweeps.half_extents[i + 1] == 0 && sweeps.half_extents[i + 2] == 0)
        return wrong(Reason::kOutOfRange, "sweeps.half_extents", i / 3,
                     "must not all be 0: ask rays for moving points");
    return check_rotations(sweeps.rotations, "sweeps.rotations");
  }

  absl::Status check_rotations(absl::Span<const float> values, absl::string_view field) const {
    for (size_t i = 0; i + 3 < values.size(); i += 4) {
      const double deviation = unit_deviation({values[i], values[i + 1], values[i + 2], values[i + 3]});
      if (!std::isfinite(deviation)) return wrong(Reason::kNotFinite, field, i / 4, "needs finite numbers");
      if (deviation > limits::kMaxQuaternionDeviation)
        return wrong(Reason::kOutOfRange, field, i / 4, "must be a quaternion (x, y, z, w) of unit length");
    }
    return absl::OkStatus();
  }

  absl::Status check_kind(const NearestColumns& nearest) const {
    RETURN_IF_ERROR(check_length(nearest.points.size(), 3, ColumnNeed::kEach, "nearest.points"));
    RETURN_IF_ERROR(check_length(nearest.max_distances.size(), 1, ColumnNeed::kOptional, "nearest.max_distances"));
    if (nearest.count > limits::kMaxNearest)
      return refuse_limit(name("nearest.k"), "nearest", limits::kMaxNearest, nearest.count);
    RETURN_IF_ERROR(check_points(nearest.points, "nearest.points"));
    RETURN_IF_ERROR(check_after(nearest.after, "nearest"));
    return check_distance_limits(nearest.max_distances, "nearest.max_distances");
  }

  absl::Status check_kind(const FrustumColumns& frustums) const {
    const bool by_planes = frustums.view_projections.empty();
    if (!by_planes && !frustums.planes.empty())
      return refuse_argument(Reason::kMalformed, name("frustums"), {}, "give either planes or view_projections");
    if (!by_planes && frustums.planes_each != 0)
      return refuse_argument(Reason::kMalformed, name("frustums.planes_each"), {}, "needs planes");
    if (frustums.planes_each != 0 &&
        (frustums.planes_each < limits::kMinPlanes || frustums.planes_each > limits::kMaxPlanes))
      return refuse_limit(name("frustums.planes_each"), "planes", limits::kMaxPlanes, frustums.planes_each);
    const absl::string_view field = by_planes ? "frustums.planes" : "frustums.view_projections";
    const absl::Span<const float> values = by_planes ? frustums.planes : frustums.view_projections;
    const size_t width = by_planes ? 4 * frustums.planes_per_region() : 16;
    RETURN_IF_ERROR(check_length(values.size(), width, ColumnNeed::kEach, field));
    for (size_t i = 0; i < values.size(); ++i)
      if (!std::isfinite(values[i])) return wrong(Reason::kNotFinite, field, i / width, "needs finite numbers");
    for (size_t i = 0; i < n_; ++i) RETURN_IF_ERROR(check_region(frustums, field, i));
    return absl::OkStatus();
  }

  // Checks that region `i` has an interior point. A region relative to an anchor is checked as if the anchor were at
  // the world's origin.
  absl::Status check_region(const FrustumColumns& frustums, absl::string_view field, size_t i) const {
    const FrustumPlanes planes(frustums, i);
    switch (planes.fault()) {
      case FrustumPlanes::Fault::kNone:
        break;
      case FrustumPlanes::Fault::kZeroNormal:
        return wrong(Reason::kOutOfRange, field, i, "has a plane without a normal that excludes everything");
      case FrustumPlanes::Fault::kSingular:
        return wrong(Reason::kOutOfRange, field, i, "must be a matrix whose determinant is not 0");
    }
    if (ConvexRegion::make(origin(), planes.planes())) return absl::OkStatus();
    return wrong(Reason::kOutOfRange, field, i, "must have a point inside of all planes and the world");
  }

  absl::Status check_kind(const ContainsColumns& contains) const {
    RETURN_IF_ERROR(check_length(contains.points.size(), 3, ColumnNeed::kEach, "contains.points"));
    return check_points(contains.points, "contains.points");
  }

  absl::Status check_kind(const SightColumns& sight) const {
    if (sight.samples > limits::kMaxSightSamples)
      return refuse_limit(name("sight.samples_per_target"), "sight_samples", limits::kMaxSightSamples, sight.samples);
    if (sight.eyes > limits::kMaxSightEyes)
      return refuse_limit(name("sight.eyes_per_viewer"), "sight_eyes", limits::kMaxSightEyes, sight.eyes);
    const size_t eyes = sight.eyes_per_viewer(), samples = sight.samples_per_target(), targets = sight.target_count();
    RETURN_IF_ERROR(check_length(sight.viewers.size(), 3 * eyes, ColumnNeed::kEach, "sight.viewers"));
    RETURN_IF_ERROR(check_column(sight.targets.size(), 3 * samples, targets, ColumnNeed::kEach,
                                 {"blocks", index_, "sight.targets"}));
    if (sight.pairwise && targets != n_)
      return refuse_argument(Reason::kColumnLength, name("sight.targets"), {},
                             absl::StrCat("pairwise needs as many targets as viewers, ", n_, ", not ", targets));
    RETURN_IF_ERROR(check_length(sight.viewer_groups.size(), 1, ColumnNeed::kOptional, "sight.viewer_groups"));
    RETURN_IF_ERROR(check_column(sight.target_groups.size(), 1, targets, ColumnNeed::kOptional,
                                 {"blocks", index_, "sight.target_groups"}));
    RETURN_IF_ERROR(check_length(sight.max_distances.size(), 1, ColumnNeed::kOptional, "sight.max_distances"));
    RETURN_IF_ERROR(check_points(sight.viewers, "sight.viewers", eyes));
    RETURN_IF_ERROR(check_points_from(block_.frame, sight.targets, "sight.targets", samples));
    return check_distance_limits(sight.max_distances, "sight.max_distances");
  }

  absl::Status check_kind(const PairColumns& pairs) const {
    const float distance = pairs.max_distance;
    if (std::isnan(distance))
      return refuse_argument(Reason::kNotFinite, name("pairs.max_distance"), {}, "must be a number");
    const bool endless = std::isinf(distance) && pairs.count != 0;
    if (distance < 0 || (distance > limits::kMaxCoordinate && !endless))
      return refuse_argument(Reason::kOutOfRange, name("pairs.max_distance"), {},
                             "must lie between 0 and 1e9, or be infinite with k");
    if (pairs.count > limits::kMaxPairNeighbours)
      return refuse_limit(name("pairs.k"), "pair_neighbours", limits::kMaxPairNeighbours, pairs.count);
    if (pairs.after_other != 0 && block_.after_id == kNoId)
      return refuse_argument(Reason::kMalformed, name("pairs.after_other"), {}, "needs after_id");
    return absl::OkStatus();
  }

  absl::Status check_kind(const CellColumns& cells) const {
    RETURN_IF_ERROR(check_length(cells.points.size(), 3, ColumnNeed::kEach, "cells.points"));
    RETURN_IF_ERROR(check_length(cells.max_distances.size(), 1, ColumnNeed::kEachOrOne, "cells.max_distances"));
    if (cells.max_planes > limits::kMaxCellPlanes)
      return refuse_limit(name("cells.max_planes"), "cell_planes", limits::kMaxCellPlanes, cells.max_planes);
    RETURN_IF_ERROR(check_points(cells.points, "cells.points"));
    RETURN_IF_ERROR(check_sizes(cells.max_distances, 1, "cells.max_distances"));
    for (size_t i = 0; i < cells.max_distances.size(); ++i)
      if (cells.max_distances[i] == 0) return wrong(Reason::kOutOfRange, "cells.max_distances", i, "must not be 0");
    return absl::OkStatus();
  }

  absl::Status check_kind(const LookupColumns& lookup) const {
    if (lookup.ids.empty() == lookup.groups.empty())
      return refuse_argument(Reason::kMalformed, name("lookup"), {}, "give either ids or groups");
    for (size_t i = 0; i < lookup.ids.size(); ++i)
      if (lookup.ids[i] == kNoId) return wrong(Reason::kOutOfRange, "lookup.ids", i, "0 is not an id");
    for (size_t i = 0; i < lookup.groups.size(); ++i)
      if (lookup.groups[i] == 0) return wrong(Reason::kOutOfRange, "lookup.groups", i, "0 is not a group");
    return absl::OkStatus();
  }

  const QueryBlock& block_;
  const size_t index_;
  size_t n_ = 0;  // number of queries
};

struct CountQueries {
  size_t operator()(const RayColumns& rays) const {
    return rays.origins.size() == 3 ? std::max<size_t>(rays.directions.size() / 3, 1) : rays.origins.size() / 3;
  }
  size_t operator()(const BallColumns& balls) const { return balls.centers.size() / 3; }
  size_t operator()(const BoxColumns& boxes) const { return boxes.centers.size() / 3; }
  size_t operator()(const CapsuleColumns& capsules) const { return capsules.starts.size() / 3; }
  size_t operator()(const SweepColumns& sweeps) const { return sweeps.starts.size() / 3; }
  size_t operator()(const NearestColumns& nearest) const { return nearest.points.size() / 3; }
  size_t operator()(const FrustumColumns& frustums) const {
    return frustums.view_projections.empty() ? frustums.planes.size() / (4 * frustums.planes_per_region())
                                             : frustums.view_projections.size() / 16;
  }
  size_t operator()(const SightColumns& sight) const { return sight.viewer_count(); }
  size_t operator()(const ContainsColumns& contains) const { return contains.points.size() / 3; }
  size_t operator()(const PairColumns&) const { return 1; }
  size_t operator()(const CellColumns& cells) const { return cells.points.size() / 3; }
  size_t operator()(const LookupColumns& lookup) const {
    return lookup.groups.empty() ? lookup.ids.size() : lookup.groups.size();
  }
};

// Returns the number of segments from an eye to a sample point in all blocks, or 2^64 - 1 if the number exceeds 2^62.
uint64_t sight_segments(const QueryBatch& batch) {
  uint64_t segments = 0;
  for (const QueryBlock& block : batch.blocks) {
    const auto* const sight = std::get_if<SightColumns>(&block.kind);
    if (sight == nullptr) continue;
    const uint64_t eyes = sight->viewers.size() / 3;
    const uint64_t samples = sight->pairwise ? sight->samples_per_target() : sight->targets.size() / 3;
    if (samples != 0 && eyes > (uint64_t{1} << 62) / samples) return ~uint64_t{0};
    segments += eyes * samples;
    if (segments > uint64_t{1} << 62) return ~uint64_t{0};
  }
  return segments;
}

// Returns the number of planes of the convex regions in all blocks.
uint64_t region_planes(const QueryBatch& batch) {
  uint64_t planes = 0;
  for (const QueryBlock& block : batch.blocks)
    if (const auto* const frustums = std::get_if<FrustumColumns>(&block.kind))
      planes += frustums->planes.size() / 4 + frustums->view_projections.size() / 16 * limits::kDefaultPlanes;
  return planes;
}

}  // namespace

size_t query_count(const QueryBlock& block) { return std::visit(CountQueries(), block.kind); }

absl::Status check_batch(const QueryBatch& batch) {
  if (batch.blocks.size() > limits::kMaxBlocks)
    return refuse_limit("blocks", "blocks", limits::kMaxBlocks, static_cast<double>(batch.blocks.size()));
  size_t rays = 0, queries = 0;
  for (const QueryBlock& block : batch.blocks)
    (block_kind(block) == BlockKind::kRay ? rays : queries) += query_count(block);
  if (rays > limits::kMaxRays) return refuse_limit("blocks", "rays", limits::kMaxRays, static_cast<double>(rays));
  if (queries > limits::kMaxQueries)
    return refuse_limit("blocks", "queries", limits::kMaxQueries, static_cast<double>(queries));
  if (const uint64_t planes = region_planes(batch); planes > limits::kMaxRegionPlanes)
    return refuse_limit("blocks", "region_planes", limits::kMaxRegionPlanes, static_cast<double>(planes));
  if (const uint64_t segments = sight_segments(batch); segments > limits::kMaxSightSegments)
    return refuse_limit("blocks", "sight_segments", limits::kMaxSightSegments, static_cast<double>(segments));
  if (batch.max_reply_bytes > limits::kMaxReplyBytes)
    return refuse_limit("max_reply_bytes", "max_reply_bytes", limits::kMaxReplyBytes, batch.max_reply_bytes);
  for (size_t i = 0; i < batch.blocks.size(); ++i) RETURN_IF_ERROR(BlockCheck(batch.blocks[i], i).run());
  return check_reply_size(batch);
}

}  // namespace locus
