// Verification of conservative answers. A conservative answer is compared with the exact answer, which it must contain,
// and with bounds of placed triangles that are computed in long double without the arithmetic of the product.
#ifndef LOCUS_TESTS_SUPPORT_CONSERVATIVE_ANSWERS_H_
#define LOCUS_TESTS_SUPPORT_CONSERVATIVE_ANSWERS_H_

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/random_query.h"
#include "tests/support/real.h"

namespace locus::test {

namespace internal {

struct FoundRow {
  float t = 0;
  Vec3f point;  // nearest point of the triangle, relative to the frame; nearest queries only
};
using Found = std::map<std::pair<Id, uint32_t>, FoundRow>;  // key: id and triangle

// Returns whether the exact and the conservative answer to the block can be compared. Lookups, contains, sight and
// pairs are excluded, because their rows name no triangles. Cells are excluded, because a conservative cell can have an
// additional wall that hides walls of the exact cell, so it need not contain all rows of the exact cell.
inline bool is_judged(const OwnedBlock& block) {
  const auto& kind = block.settings.kind;
  return !std::holds_alternative<LookupColumns>(kind) && !std::holds_alternative<ContainsColumns>(kind) &&
         !std::holds_alternative<SightColumns>(kind) && !std::holds_alternative<PairColumns>(kind) &&
         !std::holds_alternative<CellColumns>(kind);
}

// Returns the rows of each query at `precision`, with detail kTriangles for nearest queries and mode kAll for rays and
// sweeps. To get all rows of each query, the function requests rows instead of counts, removes the page position (the
// `after` columns), and sets the highest maximum number of results.
inline std::vector<Found> found_by(const SceneSnapshot& snapshot, OwnedBlock block, Precision precision) {
  block.settings.precision = precision;
  block.settings.max_results = limits::kMaxMaxResults;
  block.settings.count_only = false;
  block.after_ts.clear();
  block.after_ids.clear();
  block.after_triangles.clear();
  block.settings.columns = {Column::kId, Column::kTriangle};
  if (auto* rays = std::get_if<RayColumns>(&block.settings.kind); rays != nullptr) {
    rays->mode = RayMode::kAll;
    block.settings.columns.add(Column::kT);
  }
  if (auto* sweeps = std::get_if<SweepColumns>(&block.settings.kind); sweeps != nullptr) {
    sweeps->mode = RayMode::kAll;
    block.settings.columns.add(Column::kT);
  }
  if (auto* nearest = std::get_if<NearestColumns>(&block.settings.kind); nearest != nullptr) {
    nearest->detail = StaticDetail::kTriangles;
    nearest->count = limits::kMaxNearest;
    block.settings.columns.add(Column::kT);
    block.settings.columns.add(Column::kPoint);
  }
  const bool one_row = std::visit(
      [](const auto& kind) {
        if constexpr (requires { kind.detail; }) return kind.detail == StaticDetail::kInstances;
        return false;
      },
      block.settings.kind);
  const BlockResult result = run_block(snapshot, block);
  LOCUS_CHECK(result.truncated.empty());
  std::vector<Found> found;
  size_t row = 0;
  for (const uint32_t rows : result.counts) {
    found.emplace_back();
    for (const size_t end = row + rows; row < end; ++row) {
      // With one row for each object, the row of a compound names its nearest part, which depends on the precision.
      FoundRow& one = found.back()[{result.ids[row], one_row ? kNoTriangle : result.triangles[row]}];
      if (!result.t.empty()) one.t = result.t[row];
      if (!result.points.empty())
        one.point = {result.points[3 * row], result.points[3 * row + 1], result.points[3 * row + 2]};
    }
  }
  return found;
}

inline std::string name_of(std::pair<Id, uint32_t> key) {
  return "id " + std::to_string(key.first) + " triangle " + std::to_string(key.second);
}

inline std::string lacking(const Found& exact, const Found& conservative) {
  for (const auto& [key, row] : exact) {
    const auto other = conservative.find(key);
    if (other == conservative.end()) return name_of(key) + " is not found";
    if (!(other->second.t <= row.t))
      return name_of(key) + " is found at " + std::to_string(other->second.t) + ", after " + std::to_string(row.t);
  }
  return "";
}

using BoxReal = Aabb<Real>;

inline BoxReal placed_bounds(const PlacedMesh& placed, const Triangle& triangle) {
  BoxReal bounds;
  for (const Vec3f corner : {triangle.a, triangle.b, triangle.c})
    bounds = merge(bounds, to_real(placed.translation) + turned(placed.rotation, to_real(corner)) * Real{placed.scale});
  return bounds;
}

// One query of a block, in long double.
class RealQuery {
 public:
  RealQuery(const OwnedBlock& block, size_t i) : at_(to_real(block.settings.frame) + triple(block.points, i)) {
    if (std::holds_alternative<RayColumns>(block.settings.kind)) direction_ = triple(block.sizes, i);
    if (std::holds_alternative<BallColumns>(block.settings.kind)) radius_ = entry(block.sizes, i);
    if (std::holds_alternative<BoxColumns>(block.settings.kind)) half_ = half_bounds(block, i);
  }

  // Returns nullopt if the query does not intersect the box. Otherwise returns the t at which a ray enters the box, the
  // distance of a point from the box, or 0 for a ball or box.
  std::optional<Real> meets(const BoxReal& box) const {
    if (direction_) return entered(box);
    const Vec3r gap = max(max(box.min - at_, at_ - box.max), Vec3r{});
    if (half_)
      return gap.x <= half_->x && gap.y <= half_->y && gap.z <= half_->z ? std::optional<Real>(0) : std::nullopt;
    if (radius_) return length(gap) <= *radius_ ? std::optional<Real>(0) : std::nullopt;
    return length(gap);
  }
  bool is_point() const { return !direction_ && !half_ && !radius_; }
  // Returns the largest |coordinate| of the query's origin or centre plus the largest size of its ball or box.
  Real magnitude() const {
    const Real size = half_ ? max_component(*half_) : radius_.value_or(0);
    return max_component(abs(at_)) + size;
  }

 private:
  static Vec3r triple(const std::vector<float>& column, size_t i) {
    const size_t first = column.size() == 3 ? 0 : 3 * i;
    return {column[first], column[first + 1], column[first + 2]};
  }
  static Real entry(const std::vector<float>& column, size_t i) { return column[column.size() == 1 ? 0 : i]; }

  // Returns the half extents of the bounds, in world axes, of the box of query `i`. The box may be rotated.
  static Vec3r half_bounds(const OwnedBlock& block, size_t i) {
    const Vec3r half = triple(block.sizes, i);
    if (block.extras.empty()) return half;
    const float* q = &block.extras[block.extras.size() == 4 ? 0 : 4 * i];
    Vec3r bounds;
    for (int axis = 0; axis < 3; ++axis) {
      Vec3r side;
      side[axis] = half[axis];
      bounds = bounds + abs(turned({q[0], q[1], q[2], q[3]}, side));
    }
    return bounds;
  }

  std::optional<Real> entered(const BoxReal& box) const {
    Real near = 0, far = std::numeric_limits<Real>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      const Real o = at_[axis], d = (*direction_)[axis];
      if (d == 0 && (o < box.min[axis] || o > box.max[axis])) return std::nullopt;
      if (d == 0) continue;
      near = std::max(near, ((d > 0 ? box.min[axis] : box.max[axis]) - o) / d);
      far = std::min(far, ((d > 0 ? box.max[axis] : box.min[axis]) - o) / d);
    }
    return near <= far ? std::optional<Real>(near) : std::nullopt;
  }

  Vec3r at_;
  std::optional<Vec3r> direction_, half_;
  std::optional<Real> radius_;
};

// Returns a description of the error in the conservative answer of one query about one triangle; empty if there is
// none.
inline std::string triangle_fault(const RealQuery& query, const PlacedMesh& placed, uint32_t number, const Found& exact,
                                  const Found& conservative) {
  const std::pair<Id, uint32_t> key{placed.id, number};
  const BoxReal bounds = placed_bounds(placed, placed.mesh->triangle(number));
  const Real size =
      max_component(abs(to_real(placed.translation))) + 4 * placed.scale * Real{magnitude(placed.mesh->bounds())};
  const Real slack = 0x1p-38L * (size + query.magnitude());
  const std::optional<Real> inner = query.meets(bounds), outer = query.meets(grown(bounds, slack));
  const auto found = conservative.find(key);
  if (found == conservative.end()) return inner ? name_of(key) + " is not found" : "";
  const auto exactly = exact.find(key);
  const float t = found->second.t;
  if (exactly != exact.end() && exactly->second.t == t) return "";
  if (!outer) return name_of(key) + " is found far outside of its bounds";
  constexpr Real kRounding = 0x1p-22L;
  if (t < *outer * (1 - kRounding) || (inner && t > *inner * (1 + kRounding)))
    return name_of(key) + " is found at " + std::to_string(t) + ", where its bounds begin at " + std::to_string(*outer);
  return "";
}

// Returns a description of the error if the point of the row is not at the row's distance; otherwise an empty string.
inline std::string point_fault(const OwnedBlock& block, size_t i, const FoundRow& row) {
  const Vec3r from = {block.points[3 * i], block.points[3 * i + 1], block.points[3 * i + 2]};
  const Real away = length(to_real(row.point) - from);
  const Real rounding = 0x1p-21L * (length(from) + length(to_real(row.point))) +
                        0x1p-50L * max_component(abs(to_real(block.settings.frame)));
  if (std::abs(away - row.t) <= rounding) return "";
  return "distance " + std::to_string(row.t) + ", but the point is " + std::to_string(away) + " away";
}

inline std::string query_fault(const QueryWorld& world, const OwnedBlock& block, size_t i, const Found& exact,
                               const Found& conservative) {
  const RealQuery query(block, i);
  for (const PlacedMesh& placed : world.instances)
    for (uint32_t number = 0; number < placed.mesh->triangle_count(); ++number)
      if (std::string what = triangle_fault(query, placed, number, exact, conservative); !what.empty()) return what;
  if (!query.is_point()) return "";
  for (const auto& [key, row] : conservative)
    if (const std::string what = point_fault(block, i, row); !what.empty()) return name_of(key) + ": " + what;
  return "";
}

template <class Fault>
std::string conservative_fault(const QueryScene& scene, const Fault& fault) {
  const SnapshotPtr snapshot = snapshot_of(scene.world);
  for (size_t b = 0; b < scene.blocks.size(); ++b) {
    const OwnedBlock& block = scene.blocks[b];
    if (!is_judged(block)) continue;
    const auto exact = found_by(*snapshot, block, Precision::kExact);
    const auto conservative = found_by(*snapshot, block, Precision::kConservative);
    for (size_t i = 0; i < exact.size(); ++i)
      if (const std::string what = fault(block, i, exact[i], conservative[i]); !what.empty())
        return "block " + std::to_string(b) + ", query " + std::to_string(i) + ": " + what;
  }
  return "";
}

}  // namespace internal

// Returns a description of the first row of the exact answers that is missing in the conservative answers or has a
// greater t there; empty if there is no such row.
inline std::string superset_fault(const QueryScene& scene) {
  return internal::conservative_fault(
      scene, [](const OwnedBlock& /*block*/, size_t /*query*/, const internal::Found& exact,
                const internal::Found& conservative) { return internal::lacking(exact, conservative); });
}

// Returns a description of the first error in the conservative answers; empty if there is none. The errors are: the
// query intersects the bounds of a triangle that has no row; a triangle has a row, but the query does not intersect its
// bounds, grown by a tolerance; a row's t is neither the t of the exact row nor that of the bounds; the point of a
// nearest query's row is not at distance t. The tolerance is 2^-38 of the sum of an upper bound of the |coordinates| of
// the placed mesh and the magnitude of the query. Preconditions: the scene has only instances, and the queries have no
// filters, limits or culling.
inline std::string placed_bounds_fault(const QueryScene& scene) {
  return internal::conservative_fault(
      scene, [&](const OwnedBlock& block, size_t i, const internal::Found& exact, const internal::Found& conservative) {
        return internal::query_fault(scene.world, block, i, exact, conservative);
      });
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_CONSERVATIVE_ANSWERS_H_
