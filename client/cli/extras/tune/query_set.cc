#include "client/cli/extras/tune/query_set.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "client/cli/extras/verify/answer_comparison.h"
#include "client/cli/levels/generate/splitmix64.h"
#include "client/lib/query_builder.h"
#include "core/base/check.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr uint32_t kNeighbours = 8, kSpacingSample = 256;
constexpr uint32_t kQueriesOfAKind = 1024, kQueriesInBatch = 128;
// Lengths of solids in units of the spacing: between 2^-1 and 2^3. Rays are 16 times as long.
constexpr double kShortestExponent = -1, kExponents = 4, kRayFactor = 16;

// Maker of random queries around objects, relative to the frame of the scene's middle.
class TypicalQueries {
 public:
  TypicalQueries(const v1::Scene& scene, const std::vector<std::array<double, 3>>& positions, uint64_t seed)
      : random_(seed), positions_(positions) {
    const v1::Vec3d &low = scene.min(), &high = scene.max();
    frame_ = {low.x() / 2 + high.x() / 2, low.y() / 2 + high.y() / 2, low.z() / 2 + high.z() / 2};
    size_ = std::max({high.x() - low.x(), high.y() - low.y(), high.z() - low.z(), 1e-3});
  }

  // Asks for the distance within which an object of the sample has kNeighbours others, in the median.
  absl::Status learn_spacing(const client::Client& client, const std::string& scene) {
    client::QueryBuilder builder;
    client::NearestBlock nearest = builder.nearest();
    for (uint32_t i = 0; i < kSpacingSample; ++i) nearest.point(place(0));
    const v1::Column columns[] = {v1::COLUMN_T};
    nearest.k(kNeighbours + 1).frame(frame_).source(v1::SOURCE_DYNAMIC).columns(columns);
    ASSIGN_OR_RETURN(const v1::QueryResult result, client.query(scene, builder.build()));
    std::vector<float> distances;
    int row = 0;
    for (const v1::BlockResult& block : result.blocks()) {
      for (const uint32_t count : block.counts()) {
        row += static_cast<int>(count);
        if (count > 0 && row <= block.t_size()) distances.push_back(block.t(row - 1));
      }
    }
    spacing_ = size_ / 100;
    if (!distances.empty()) {
      const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
      std::nth_element(distances.begin(), middle, distances.end());
      if (*middle > 0) spacing_ = double{*middle};
    }
    return absl::OkStatus();
  }

  v1::QueryBatch rays() {
    client::QueryBuilder builder;
    client::RayBlock block = builder.rays();
    for (uint32_t i = 0; i < kQueriesInBatch; ++i) {
      const client::Float3 origin = place(spacing_), direction = way();
      block.ray(origin, direction, static_cast<float>(kRayFactor) * length());
    }
    const v1::Column columns[] = {v1::COLUMN_T, v1::COLUMN_ID};
    block.frame(frame_).columns(columns);
    return builder.build();
  }
  v1::QueryBatch balls() {
    client::QueryBuilder builder;
    client::BallBlock block = builder.balls();
    for (uint32_t i = 0; i < kQueriesInBatch; ++i) {
      const client::Float3 centre = place(spacing_);
      block.ball(centre, length());
    }
    block.frame(frame_).columns(kIds);
    return builder.build();
  }
  v1::QueryBatch boxes() {
    client::QueryBuilder builder;
    client::BoxBlock block = builder.boxes();
    for (uint32_t i = 0; i < kQueriesInBatch; ++i) {
      const client::Float3 centre = place(spacing_);
      const float x = length(), y = length(), z = length();
      block.box(centre, {x, y, z});
    }
    block.frame(frame_).columns(kIds);
    return builder.build();
  }
  v1::QueryBatch nearest() {
    client::QueryBuilder builder;
    client::NearestBlock block = builder.nearest();
    for (uint32_t i = 0; i < kQueriesInBatch; ++i) block.point(place(spacing_));
    block.k(kNeighbours).frame(frame_).columns(kIds);
    return builder.build();
  }

 private:
  static constexpr std::array<v1::Column, 1> kIds = {v1::COLUMN_ID};

  // Returns the position of a random object, moved by up to `jitter` along each axis, relative to the frame.
  client::Float3 place(double jitter) {
    const std::array<double, 3>& at = positions_[random_.below(static_cast<uint32_t>(positions_.size()))];
    const double x = at[0] - frame_.x + jitter * (2 * random_.unit() - 1);
    const double y = at[1] - frame_.y + jitter * (2 * random_.unit() - 1);
    const double z = at[2] - frame_.z + jitter * (2 * random_.unit() - 1);
    return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
  }
  float length() { return static_cast<float>(spacing_ * std::exp2(kShortestExponent + kExponents * random_.unit())); }
  // Returns a unit vector in a random direction.
  client::Float3 way() {
    double x = 0, y = 0, z = 0, squared = 0;
    while (squared < 0.01 || squared > 1) {
      x = 2 * random_.unit() - 1, y = 2 * random_.unit() - 1, z = 2 * random_.unit() - 1;
      squared = x * x + y * y + z * z;
    }
    const double factor = 1 / std::sqrt(squared);
    return {static_cast<float>(x * factor), static_cast<float>(y * factor), static_cast<float>(z * factor)};
  }

  SplitMix64 random_;
  const std::vector<std::array<double, 3>>& positions_;
  client::Double3 frame_;
  double size_ = 1;
  double spacing_ = 1;
};

}  // namespace

std::string kind_of(const v1::QueryBatch& batch) {
  return batch.blocks().empty() ? "none" : std::string(kind_name(batch.blocks(0)));
}

void QuerySet::add(v1::QueryBatch batch, const std::string& place) {
  for (const v1::QueryBlock& block : batch.blocks()) {
    added_ += query_count(block);
    counts_[std::string(kind_name(block))] += query_count(block);
  }
  const std::string kind = kind_of(batch);
  Kept& kept = kept_[kind];
  if (kept.offered++ % kept.stride != 0) return;
  if (kept.batches == kMaxBatches) {  // keeps every second batch from now on
    size_t passed = 0;
    std::erase_if(batches_, [&](const Entry& entry) { return kind_of(entry.batch) == kind && passed++ % 2 != 0; });
    kept.batches /= 2;
    kept.stride *= 2;
  }
  batch.set_explain(true);
  batches_.push_back({std::move(batch), place});
  ++kept.batches;
}

absl::StatusOr<QuerySet> typical_queries(const client::Client& client, const v1::Scene& scene,
                                         const std::vector<std::array<double, 3>>& positions, uint64_t seed) {
  LOCUS_CHECK(!positions.empty());
  TypicalQueries typical(scene, positions, seed);
  RETURN_IF_ERROR(typical.learn_spacing(client, scene.name()));
  QuerySet set;
  for (uint32_t asked = 0; asked < kQueriesOfAKind; asked += kQueriesInBatch) {
    set.add(typical.rays(), "made queries");
    set.add(typical.balls(), "made queries");
    set.add(typical.boxes(), "made queries");
    set.add(typical.nearest(), "made queries");
  }
  return set;
}

}  // namespace locus::cli
