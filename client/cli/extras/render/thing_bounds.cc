#include "client/cli/extras/render/thing_bounds.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/lib/query_builder.h"
#include "client/lib/result_rows.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr int kSections = 16;
constexpr int kCuts = kSections - 1;  // number of cutting planes, and so of tested slabs, per side
constexpr int kSides = 6;             // lower and upper side of each axis: side = 2 axis + (1 if upper)
constexpr int kMaxRounds = 16;        // enough, since 16^16 exceeds the resolution of doubles
// A box is flat along an axis if its size along the axis is less than this share of its longest side.
constexpr double kFlat = 1e-4;
// Share of a box's longest side by which the box is widened. It exceeds the error of rounding slabs to float.
constexpr double kWidening = 1e-6;

absl::Status not_found(const std::string& scene, uint64_t id, absl::string_view why) {
  return absl::NotFoundError(absl::StrCat("scene ", scene, " has no object or instance ", id, why));
}

absl::Status check_there(const client::Client& client, const std::string& scene, const client::Revision& revision,
                         uint64_t id) {
  client::QueryBuilder builder;
  builder.exactly(revision).lookup().id(id);
  ASSIGN_OR_RETURN(const v1::QueryResult result, client.query(scene, builder.build()));
  if (result.blocks_size() != 1 || result.blocks(0).ids_size() != 1)
    return absl::DataLossError("the answer to a lookup does not have one row for its id");
  return result.blocks(0).ids(0) == id ? absl::OkStatus() : not_found(scene, id, "");
}

// Returns the slab of `box` between its side `side` and the plane `cut`, which is parallel to this side. Cut c is
// inward from the side by (c + 1) / 16 of the box's size along that axis.
Aabbd slab_of(const Aabbd& box, int side, int cut) {
  const int axis = side / 2;
  Aabbd slab = box;
  const double depth = (box.max[axis] - box.min[axis]) * (cut + 1) / kSections;
  if (side % 2 == 0) {
    slab.max[axis] = box.min[axis] + depth;
  } else {
    slab.min[axis] = box.max[axis] - depth;
  }
  return slab;
}

// Returns one value for each slab of `box`: whether the object or instance `id` overlaps the slab. The slabs are
// ordered by side, and for each side by cut. Slabs are sent relative to the box's centre, so that float precision
// increases as the box shrinks.
absl::StatusOr<std::vector<bool>> ask_slabs(const client::Client& client, const std::string& scene,
                                            const client::Revision& revision, uint64_t id, const Aabbd& box) {
  const Vec3d frame = (box.min + box.max) * 0.5;
  std::vector<float> centres;
  std::vector<float> half_extents;
  for (int side = 0; side < kSides; ++side) {
    for (int cut = 0; cut < kCuts; ++cut) {
      const Aabbd slab = slab_of(box, side, cut);
      const Vec3f centre = to_float((slab.min + slab.max) * 0.5 - frame);
      const Vec3f half = to_float(slab.extent() * 0.5);
      centres.insert(centres.end(), {centre.x, centre.y, centre.z});
      half_extents.insert(half_extents.end(), {half.x, half.y, half.z});
    }
  }
  client::QueryBuilder builder;
  builder.exactly(revision);
  client::BoxBlock block = builder.boxes();
  block.frame({frame.x, frame.y, frame.z}).precision(v1::PRECISION_CONSERVATIVE).after_id(id - 1).max_results(1);
  block.boxes(centres, half_extents);
  ASSIGN_OR_RETURN(const v1::QueryResult result, client.query(scene, builder.build()));
  if (result.blocks_size() != 1) return absl::DataLossError("the answer does not have one result block");
  ASSIGN_OR_RETURN(const client::Overlaps found, client::Overlaps::of(result.blocks(0)));
  if (found.size() != size_t{kSides} * kCuts)
    return absl::DataLossError("the answer does not have one result for each box");
  std::vector<bool> reached;
  for (size_t i = 0; i < found.size(); ++i) {
    reached.push_back(!found.ids(i).empty() && found.ids(i).front() == id);
  }
  return reached;
}

Aabbd widened(const Aabbd& box) {
  const double epsilon = max_component(box.extent()) * kWidening;
  return {box.min - Vec3d{epsilon, epsilon, epsilon}, box.max + Vec3d{epsilon, epsilon, epsilon}};
}

// Returns the box after one round: each side is moved inward past the slabs that the object or instance does not
// overlap, then the box is widened by kWidening. `reached` is the result of ask_slabs().
Aabbd narrowed(const Aabbd& box, const std::vector<bool>& reached) {
  Aabbd result = box;
  for (int side = 0; side < kSides; ++side) {
    int empty = 0;
    while (empty < kCuts && !reached[static_cast<size_t>(side) * kCuts + static_cast<size_t>(empty)]) ++empty;
    if (empty == 0) continue;
    const Aabbd slab = slab_of(box, side, empty - 1);
    if (side % 2 == 0) result.min[side / 2] = slab.max[side / 2];
    if (side % 2 == 1) result.max[side / 2] = slab.min[side / 2];
  }
  return widened(result);
}

// Returns whether the last round shrank the box along some axis by more than half a section (1/32 of the box's size
// along the axis), so that another round is worthwhile. Axes along which the box is flat are ignored, since widened()
// makes the box grow again along them.
bool moved(const Aabbd& before, const Aabbd& after) {
  const Vec3d old_extent = before.extent(), new_extent = after.extent();
  for (int axis = 0; axis < 3; ++axis) {
    const bool flat = old_extent[axis] < kFlat * max_component(old_extent);
    if (!flat && new_extent[axis] < old_extent[axis] * (1 - 0.5 / kSections)) return true;
  }
  return false;
}

}  // namespace

absl::StatusOr<Aabbd> thing_bounds(const client::Client& client, const std::string& scene,
                                   const client::Revision& revision, uint64_t id, const Aabbd& scene_bounds) {
  RETURN_IF_ERROR(check_there(client, scene, revision, id));
  Aabbd box = widened(scene_bounds);
  for (int round = 0; round < kMaxRounds; ++round) {
    ASSIGN_OR_RETURN(const std::vector<bool> reached, ask_slabs(client, scene, revision, id, box));
    const bool seen = std::find(reached.begin(), reached.end(), true) != reached.end();
    if (!seen && round == 0) return not_found(scene, id, " that queries see: it is hidden (layers 0)");
    if (!seen) break;
    const Aabbd before = std::exchange(box, narrowed(box, reached));
    if (!moved(before, box)) break;
  }
  return box;
}

}  // namespace locus::cli
