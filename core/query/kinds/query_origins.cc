#include "core/query/kinds/query_origins.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/base/column.h"

namespace locus {
namespace {

// Returns the position of the object or instance `id` at the time `moment`. Returns nullopt if neither exists.
std::optional<Vec3d> position_of(const SceneAtTime& moment, Id id) {
  if (const GridRef object = moment.objects().find_ref(id)) return moment.shape(object).position;
  if (const Instance* instance = moment.statics().find(id)) return instance->transform.translation;
  return std::nullopt;
}

// Returns whether the points of query `i` lie within the world. `column` has the offsets of the points from `origin`:
// `points_each` points for each query, or `points_each` points that all queries share.
bool within_world(Vec3d origin, absl::Span<const float> column, size_t points_each, size_t i) {
  const ColumnReader<float> reader(column, 3 * points_each);
  if (!reader.given()) return true;
  const float* const points = reader.entry(i);
  for (size_t k = 0; k < 3 * points_each; ++k)
    if (!(std::abs(origin[static_cast<int>(k % 3)] + double{points[k]}) <= limits::kMaxCoordinate)) return false;
  return true;
}

// Returns whether all positions of query `i` lie within the world.
struct WithinWorld {
  Vec3d origin;
  size_t i;

  bool operator()(const RayColumns& rays) const { return within_world(origin, rays.origins, 1, i); }
  bool operator()(const BallColumns& balls) const { return within_world(origin, balls.centers, 1, i); }
  bool operator()(const BoxColumns& boxes) const { return within_world(origin, boxes.centers, 1, i); }
  bool operator()(const CapsuleColumns& capsules) const {
    return within_world(origin, capsules.starts, 1, i) && within_world(origin, capsules.ends, 1, i);
  }
  bool operator()(const SweepColumns& sweeps) const {
    return within_world(origin, sweeps.starts, 1, i) && within_world(origin, sweeps.ends, 1, i);
  }
  bool operator()(const NearestColumns& nearest) const { return within_world(origin, nearest.points, 1, i); }
  bool operator()(const ContainsColumns& contains) const { return within_world(origin, contains.points, 1, i); }
  bool operator()(const CellColumns& cells) const { return within_world(origin, cells.points, 1, i); }
  bool operator()(const SightColumns& sight) const {
    return within_world(origin, sight.viewers, sight.eyes_per_viewer(), i);
  }
  bool operator()(const FrustumColumns&) const { return true; }
  bool operator()(const LookupColumns&) const { return true; }
  bool operator()(const PairColumns&) const { return true; }
};

}  // namespace

QueryOrigins::QueryOrigins(const QueryBlock& block, const QueryTimes& times) : block_(block) {
  if (block.anchor_ids.empty()) return;
  const ColumnReader<uint64_t> anchors(block.anchor_ids, 1);
  const size_t queries = query_count(block);
  const bool is_shared = block.anchor_ids.size() == 1 && !times.asks_past();
  positions_.reserve(is_shared ? 1 : queries);
  std::optional<Vec3d> position;
  for (size_t i = 0; i < queries; ++i) {
    if (i == 0 || !is_shared) {
      position = position_of(times.of(i), *anchors.entry(i));
      positions_.push_back(position.value_or(Vec3d{}));
    }
    if (!position || !std::visit(WithinWorld{*position, i}, block.kind))
      unanchored_.push_back(static_cast<uint32_t>(i));
  }
  LOCUS_DCHECK(std::is_sorted(unanchored_.begin(), unanchored_.end()));
}

bool QueryOrigins::is_unanchored(size_t i) const {
  return !unanchored_.empty() && std::binary_search(unanchored_.begin(), unanchored_.end(), static_cast<uint32_t>(i));
}

}  // namespace locus
