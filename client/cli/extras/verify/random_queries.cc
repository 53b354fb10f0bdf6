#include "client/cli/extras/verify/random_queries.h"

#include <algorithm>
#include <cmath>

namespace locus::cli {
namespace {

constexpr size_t kMaxIds = 4096;
constexpr double kMargin = 1.1;
// Lengths of solids and distances are between these parts of the scene's size.
constexpr double kShortest = 1e-4, kLongest = 0.2;

const std::vector<v1::Column> kHitColumns = {v1::COLUMN_T,      v1::COLUMN_ID,     v1::COLUMN_TRIANGLE,
                                             v1::COLUMN_NORMAL, v1::COLUMN_POINT,  v1::COLUMN_GROUP,
                                             v1::COLUMN_TAG,    v1::COLUMN_LAYERS, v1::COLUMN_POSE};
const std::vector<v1::Column> kFoundColumns = {v1::COLUMN_ID,  v1::COLUMN_TRIANGLE, v1::COLUMN_GROUP,
                                               v1::COLUMN_TAG, v1::COLUMN_LAYERS,   v1::COLUMN_POSE};
const std::vector<v1::Column> kIdColumns = {v1::COLUMN_ID, v1::COLUMN_GROUP, v1::COLUMN_TAG, v1::COLUMN_LAYERS,
                                            v1::COLUMN_POSE};

std::vector<v1::Column> with(std::vector<v1::Column> columns, v1::Column more) {
  columns.push_back(more);
  return columns;
}

void append(std::vector<float>& column, const client::Float3& v) { column.insert(column.end(), {v.x, v.y, v.z}); }

}  // namespace

RandomQueries::RandomQueries(const v1::Scene& scene, uint64_t seed)
    : random_(seed), objects_(scene.objects()), oldest_tick_(scene.oldest_tick()), tick_(scene.tick()) {
  const v1::Vec3d &low = scene.min(), &high = scene.max();
  frame_ = {low.x() / 2 + high.x() / 2, low.y() / 2 + high.y() / 2, low.z() / 2 + high.z() / 2};
  const double size = std::max({high.x() - low.x(), high.y() - low.y(), high.z() - low.z(), 1e-3});
  // A flat scene is not flat for the queries, so that some of them start beside it.
  const auto half = [size](double from, double to) {
    return static_cast<float>(std::max((to - from) / 2, size / 100));
  };
  half_ = {half(low.x(), high.x()), half(low.y(), high.y()), half(low.z(), high.z())};
  size_ = static_cast<float>(size);
}

client::Float3 RandomQueries::place() {
  const auto offset = [this](float half) { return static_cast<float>((2 * unit() - 1) * kMargin) * half; };
  const float x = offset(half_.x), y = offset(half_.y), z = offset(half_.z);
  return {x, y, z};
}

std::vector<float> RandomQueries::places(uint32_t count) {
  std::vector<float> column;
  for (uint32_t i = 0; i < count; ++i) append(column, place());
  return column;
}

float RandomQueries::length() { return size_ * static_cast<float>(kShortest * std::pow(kLongest / kShortest, unit())); }

std::vector<float> RandomQueries::lengths(uint32_t count) {
  std::vector<float> column(count);
  for (float& value : column) value = length();
  return column;
}

client::Float3 RandomQueries::way(float scale) {
  double x = 0, y = 0, z = 0, squared = 0;
  while (squared < 0.01 || squared > 1) {
    x = 2 * unit() - 1, y = 2 * unit() - 1, z = 2 * unit() - 1;
    squared = x * x + y * y + z * z;
  }
  const double factor = double{length()} * double{scale} / std::sqrt(squared);
  return {static_cast<float>(x * factor), static_cast<float>(y * factor), static_cast<float>(z * factor)};
}

client::Rotation RandomQueries::rotation() {
  double q[4], squared = 0;
  while (squared < 0.01 || squared > 1) {
    squared = 0;
    for (double& part : q) {
      part = 2 * unit() - 1;
      squared += part * part;
    }
  }
  const double norm = 1 / std::sqrt(squared);
  return {static_cast<float>(q[0] * norm), static_cast<float>(q[1] * norm), static_cast<float>(q[2] * norm),
          static_cast<float>(q[3] * norm)};
}

v1::StaticDetail RandomQueries::detail() {
  return chance(0.5) ? v1::STATIC_DETAIL_INSTANCES : v1::STATIC_DETAIL_TRIANGLES_SORTED;
}

v1::RayMode RandomQueries::mode() {
  const double part = unit();
  return part < 0.5 ? v1::RAY_MODE_FIRST : part < 0.75 ? v1::RAY_MODE_ALL : v1::RAY_MODE_ANY;
}

template <class Block>
void RandomQueries::settle(Block& block, std::vector<v1::Column> columns) {
  block.frame(frame_).columns(columns);
  if (chance(0.2)) block.source(chance(0.5) ? v1::SOURCE_STATIC : v1::SOURCE_DYNAMIC);
  if (chance(0.2)) block.precision(v1::PRECISION_CONSERVATIVE);
  if (chance(0.1)) block.masks({uint32_t{1} << random_.below(8)});
  if (oldest_tick_ < tick_ && chance(0.3)) {
    const uint64_t tick = oldest_tick_ + random_.next() % (tick_ - oldest_tick_);
    block.as_of({tick}, {static_cast<float>(random_.below(4)) / 4}).outside_history(v1::OUTSIDE_HISTORY_CLAMP);
  }
}

// Adds rays, sweeps and lines of sight.
void RandomQueries::add_lines(client::QueryBuilder& builder, uint32_t queries) {
  client::RayBlock rays = builder.rays();
  const v1::RayMode ray_mode = mode();
  rays.mode(ray_mode);
  for (uint32_t i = 0; i < queries; ++i) rays.ray(place(), way(10));
  settle(rays, ray_mode == v1::RAY_MODE_ANY ? std::vector<v1::Column>() : with(kHitColumns, v1::COLUMN_UV));

  client::SweepBlock sweeps = builder.sweeps();
  const v1::RayMode sweep_mode = mode();
  sweeps.mode(sweep_mode);
  const uint32_t solid = random_.below(3);
  for (uint32_t i = 0; i < queries; ++i) {
    const client::Float3 from = place(), step = way(5);
    const client::Float3 to = {from.x + step.x, from.y + step.y, from.z + step.z};
    if (solid == 0) sweeps.ball(from, to, length());
    if (solid == 1) sweeps.capsule(from, to, way(1), length());
    if (solid == 2) sweeps.box(from, to, {length(), length(), length()}, rotation());
  }
  settle(sweeps, sweep_mode == v1::RAY_MODE_ANY ? std::vector<v1::Column>() : kHitColumns);

  client::SightBlock sight = builder.sight();
  sight.pairwise().viewers(places(queries)).targets(places(queries));
  settle(sight, {});
}

// Adds balls, boxes and capsules.
void RandomQueries::add_solids(client::QueryBuilder& builder, uint32_t queries) {
  client::BallBlock balls = builder.balls();
  balls.detail(detail()).balls(places(queries), lengths(queries));
  settle(balls, kFoundColumns);

  client::BoxBlock boxes = builder.boxes();
  boxes.detail(detail());
  for (uint32_t i = 0; i < queries; ++i) boxes.box(place(), {length(), length(), length()}, rotation());
  settle(boxes, kFoundColumns);

  client::CapsuleBlock capsules = builder.capsules();
  capsules.detail(detail());
  for (uint32_t i = 0; i < queries; ++i) {
    const client::Float3 from = place(), step = way(2);
    capsules.capsule(from, {from.x + step.x, from.y + step.y, from.z + step.z}, length());
  }
  settle(capsules, kFoundColumns);
}

// Adds frustums, points to be contained, and pairs.
void RandomQueries::add_regions(client::QueryBuilder& builder, uint32_t queries) {
  client::FrustumBlock frustums = builder.frustums();
  std::vector<float> planes;
  for (uint32_t i = 0; i < queries; ++i) {
    const client::Float3 middle = place(), size = {length(), length(), length()};
    for (const float side : {1.0f, -1.0f}) {
      planes.insert(planes.end(), {side, 0, 0, size.x - side * middle.x});
      planes.insert(planes.end(), {0, side, 0, size.y - side * middle.y});
      planes.insert(planes.end(), {0, 0, side, size.z - side * middle.z});
    }
  }
  frustums.detail(detail()).planes(planes);
  settle(frustums, kFoundColumns);

  client::ContainsBlock contains = builder.contains();
  contains.points(places(queries));
  settle(contains, kIdColumns);

  if (!asks_pairs()) return;
  client::PairBlock pairs = builder.pairs();
  pairs.max_distance(length());
  if (chance(0.3)) pairs.k(1 + random_.below(4));
  settle(pairs, {v1::COLUMN_T, v1::COLUMN_ID, v1::COLUMN_OTHER});
}

// Adds nearest values, cells of free space, and lookups.
void RandomQueries::add_points(client::QueryBuilder& builder, uint32_t queries) {
  client::NearestBlock nearest = builder.nearest();
  nearest.k(1 + random_.below(8)).detail(detail());
  for (uint32_t i = 0; i < queries; ++i) nearest.point(place(), chance(0.5) ? length() * 10 : size_ * 4);
  settle(nearest, with(kHitColumns, v1::COLUMN_UV));

  client::CellBlock cells = builder.cells();
  cells.points(places(queries), lengths(queries));
  settle(cells, kHitColumns);

  client::LookupBlock lookup = builder.lookup();
  for (uint32_t i = 0; i < queries; ++i)
    lookup.id(ids_.empty() || chance(0.1) ? 1 + random_.below(1000)
                                          : ids_[random_.below(static_cast<uint32_t>(ids_.size()))]);
  settle(lookup, kIdColumns);
}

v1::QueryBatch RandomQueries::next(uint32_t queries) {
  client::QueryBuilder builder;
  add_lines(builder, queries);
  add_solids(builder, queries);
  add_regions(builder, queries);
  add_points(builder, queries);
  return builder.build();
}

void RandomQueries::learn_ids(const v1::QueryResult& result) {
  for (const v1::BlockResult& block : result.blocks())
    for (const uint64_t id : block.ids())
      if (id != 0 && ids_.size() < kMaxIds) ids_.push_back(id);
}

}  // namespace locus::cli
