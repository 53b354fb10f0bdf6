#include "tests/bench/dynamic/mixed_batches.h"

#include <array>

#include "core/base/check.h"

namespace locus::bench::dynamic {
namespace {

constexpr size_t kBalls = 40, kBoxes = 30, kRays = 20, kMoreBalls = 10;
constexpr size_t kBatch = kBalls + kBoxes + kRays + kMoreBalls;
constexpr std::array<float, 3> kHalf = {kReach, kReach, kReach};

void append(std::vector<float>& numbers, Vec3f v) { numbers.insert(numbers.end(), {v.x, v.y, v.z}); }

absl::Span<const float> part(const std::vector<float>& numbers, size_t begin, size_t count) {
  return absl::MakeConstSpan(numbers).subspan(3 * begin, 3 * count);
}

size_t ids_found(const SceneSnapshot& snapshot, const QueryBatch& batch) {
  const absl::StatusOr<test::BatchResult> result = test::run_batch(snapshot, batch, {});
  LOCUS_CHECK_EQ(result.status(), absl::OkStatus());
  size_t found = 0;
  for (const test::BlockResult& block : result->blocks) found += block.ids.size();
  return found;
}

}  // namespace

MixedBatches::MixedBatches(const Queries& queries) : batches_(queries.centers.size() / kBatch) {
  for (const Vec3f& center : queries.centers) append(centers_, center);
  for (const Rayf& ray : queries.rays) {
    append(origins_, ray.origin);
    append(directions_, ray.direction);
  }
}

size_t MixedBatches::ask(const SceneSnapshot& snapshot, size_t number) const {
  const size_t begin = number % batches_ * kBatch;
  QueryBatch batch;
  batch.blocks = {ball_block(begin, kBalls), box_block(begin + kBalls, kBoxes),
                  ray_block(begin + kBalls + kBoxes, kRays), ball_block(begin + kBatch - kMoreBalls, kMoreBalls)};
  return ids_found(snapshot, batch);
}

QueryBlock MixedBatches::ball_block(size_t begin, size_t count) const {
  BallColumns balls;
  balls.centers = part(centers_, begin, count);
  balls.radii = absl::MakeConstSpan(&kReach, 1);
  QueryBlock block;
  block.kind = balls;
  return block;
}

QueryBlock MixedBatches::box_block(size_t begin, size_t count) const {
  BoxColumns boxes;
  boxes.centers = part(centers_, begin, count);
  boxes.half_extents = kHalf;
  QueryBlock block;
  block.kind = boxes;
  return block;
}

QueryBlock MixedBatches::ray_block(size_t begin, size_t count) const {
  RayColumns rays;
  rays.origins = part(origins_, begin, count);
  rays.directions = part(directions_, begin, count);
  rays.t_max = absl::MakeConstSpan(&kRayLength, 1);
  QueryBlock block;
  block.kind = rays;
  return block;
}

size_t count_objects(const SceneSnapshot& snapshot) {
  constexpr std::array<float, 3> kCenter = {1000, 1000, 50}, kEverything = {1e6f, 1e6f, 1e6f};
  BoxColumns box;
  box.centers = kCenter;
  box.half_extents = kEverything;
  QueryBatch batch;
  batch.max_reply_bytes = limits::kMaxReplyBytes;
  QueryBlock& block = batch.blocks.emplace_back();
  block.max_results = limits::kMaxMaxResults;
  block.kind = box;
  return ids_found(snapshot, batch);
}

}  // namespace locus::bench::dynamic
