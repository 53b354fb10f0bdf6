#include "client/cli/extras/demo/demo_queries.h"

#include <algorithm>

#include "client/lib/query_builder.h"
#include "client/lib/result_rows.h"

namespace locus::cli {
namespace {

// Maximum number of result rows of one query. Large results are truncated earlier, by the maximum size of a reply.
constexpr uint32_t kMaxRows = 65536;

client::Float3 float3(Vec3f v) { return {v.x, v.y, v.z}; }

Vec3f random_place(const DemoWorld& world, DemoRandom& random) {
  const Vec3f half = to_float(world.bounds().extent() * 0.5);
  const Vec3f at = random.cube();
  return {at.x * half.x, at.y * half.y, at.z * half.z};
}

Vec3d place(const v1::QueryBlock& block, const google::protobuf::RepeatedField<float>& column, int i) {
  const Vec3d frame{block.frame().x(), block.frame().y(), block.frame().z()};
  return frame + Vec3d{column[3 * i], column[3 * i + 1], column[3 * i + 2]};
}

Vec3d triple(const google::protobuf::RepeatedField<float>& column, int i) {
  return {column[3 * i], column[3 * i + 1], column[3 * i + 2]};
}

}  // namespace

std::string name_of(DemoKind kind) {
  switch (kind) {
    case DemoKind::kFirst:
      return "rays, first hit";
    case DemoKind::kAny:
      return "rays, any hit";
    case DemoKind::kBalls:
      return "balls";
    case DemoKind::kBoxes:
      return "boxes";
  }
  return "";
}

v1::QueryBatch demo_batch(DemoKind kind, const DemoWorld& world, DemoRandom& random, int count) {
  const Vec3d frame = world.frame();
  const client::Double3 origin{frame.x, frame.y, frame.z};
  const float length = static_cast<float>(max_component(world.bounds().extent()));
  client::QueryBuilder builder;
  if (kind == DemoKind::kFirst || kind == DemoKind::kAny) {
    client::RayBlock rays = builder.rays();
    rays.frame(origin).mode(kind == DemoKind::kFirst ? v1::RAY_MODE_FIRST : v1::RAY_MODE_ANY);
    for (int i = 0; i < count; ++i) {
      const Vec3f direction = random.direction() * length;
      rays.ray(float3(random_place(world, random)), float3(direction));
    }
  } else if (kind == DemoKind::kBalls) {
    client::BallBlock balls = builder.balls();
    balls.frame(origin).detail(v1::STATIC_DETAIL_TRIANGLES_SORTED).max_results(kMaxRows);
    for (int i = 0; i < count; ++i) {
      const float radius = length * 0.02f * random.unit();
      balls.ball(float3(random_place(world, random)), radius);
    }
  } else {
    client::BoxBlock boxes = builder.boxes();
    boxes.frame(origin).detail(v1::STATIC_DETAIL_TRIANGLES_SORTED).max_results(kMaxRows);
    for (int i = 0; i < count; ++i) {
      const Vec3f half = Vec3f{random.unit(), random.unit(), random.unit()} * (0.02f * length);
      boxes.box(float3(random_place(world, random)), float3(half));
    }
  }
  return builder.build();
}

uint64_t count_found(const v1::BlockResult& block) {
  if (!block.hits().empty()) return static_cast<uint64_t>(std::count(block.hits().begin(), block.hits().end(), '\1'));
  if (block.counts().empty())
    return static_cast<uint64_t>(block.ids_size() - std::count(block.ids().begin(), block.ids().end(), 0u));
  return static_cast<uint64_t>(block.counts_size() - std::count(block.counts().begin(), block.counts().end(), 0u));
}

DemoChecker::Outcome DemoChecker::check(DemoKind kind, const v1::QueryBatch& batch, const v1::QueryResult& result,
                                        int max_queries) {
  if (tick_ != result.tick()) {
    objects_.clear();
    for (uint32_t i = 0; i < world_.size(); ++i) objects_.push_back({world_.id(i), world_.shape(i, result.tick())});
    tick_ = result.tick();
  }
  const v1::QueryBlock& asked = batch.blocks(0);
  const v1::BlockResult& got = result.blocks(0);
  const BruteForce brute_force(instances_, objects_);
  Outcome outcome;
  const bool rays = asked.has_rays();
  const int queries = (rays ? asked.rays().origins_size() : got.counts_size() * 3) / 3;
  for (int i = 0; i < std::min(max_queries, queries); ++i) {
    bool same = false;
    if (rays)
      same = same_ray(kind, asked, got, i);
    else if (kind == DemoKind::kBalls)
      same = same_rows(brute_force.ball({place(asked, asked.balls().centers(), i), asked.balls().radii(i)}), got, i);
    else
      same = same_rows(
          brute_force.box({place(asked, asked.boxes().centers(), i), triple(asked.boxes().half_extents(), i), {}}), got,
          i);
    ++outcome.checked;
    if (!same) ++outcome.differences;
  }
  return outcome;
}

bool DemoChecker::same_ray(DemoKind kind, const v1::QueryBlock& asked, const v1::BlockResult& got, int i) const {
  const FirstHit wanted = BruteForce(instances_, objects_)
                              .first(place(asked, asked.rays().origins(), i), triple(asked.rays().directions(), i));
  if (kind == DemoKind::kAny)
    return i < static_cast<int>(got.hits().size()) && (got.hits()[static_cast<size_t>(i)] != 0) == (wanted.id != 0);
  if (i >= got.t_size() || i >= got.ids_size() || i >= got.triangles_size()) return false;
  return got.t(i) == wanted.t && got.ids(i) == wanted.id && got.triangles(i) == wanted.triangle;
}

bool DemoChecker::same_rows(const std::vector<OverlapRow>& wanted, const v1::BlockResult& got, int i) const {
  const absl::StatusOr<client::Overlaps> overlaps = client::Overlaps::of(got);
  if (!overlaps.ok()) return false;
  const auto query = static_cast<size_t>(i);
  const absl::Span<const uint64_t> ids = overlaps->ids(query);
  const absl::Span<const uint32_t> triangles = overlaps->triangles(query);
  // A reply that would be too large is truncated: it contains the first rows of the query, which is marked as
  // truncated.
  const bool cut = overlaps->rows().truncated(query);
  if (ids.size() != triangles.size() || ids.size() > wanted.size() || (!cut && ids.size() != wanted.size()))
    return false;
  for (size_t row = 0; row < ids.size(); ++row)
    if (ids[row] != wanted[row].id || triangles[row] != wanted[row].triangle) return false;
  return true;
}

}  // namespace locus::cli
