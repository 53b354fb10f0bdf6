#include "client/lib/query_blocks.h"

namespace locus::client {
namespace {

// Sets the row after which the results of rays or nearest queries continue.
template <class Kind>
void set_after(Kind& kind, absl::Span<const float> ts, absl::Span<const uint64_t> ids,
               absl::Span<const uint32_t> triangles) {
  assign(*kind.mutable_after_ts(), ts);
  assign(*kind.mutable_after_ids(), ids);
  assign(*kind.mutable_after_triangles(), triangles);
}

template <class T>
void append(google::protobuf::RepeatedField<T>& column, absl::Span<const T> values) {
  column.Add(values.begin(), values.end());
}

}  // namespace

RayBlock& RayBlock::mode(v1::RayMode mode) {
  rays_->set_mode(mode);
  return *this;
}

RayBlock& RayBlock::cull(v1::Cull cull) {
  rays_->set_cull(cull);
  return *this;
}

RayBlock& RayBlock::inside(v1::Inside inside) {
  rays_->set_inside(inside);
  return *this;
}

RayBlock& RayBlock::ray(const Float3& origin, const Float3& direction, float t_max, const Filter& filter) {
  const int rows_before = rays_->origins_size() / 3;
  append_triple(*rays_->mutable_origins(), origin);
  append_triple(*rays_->mutable_directions(), direction);
  append_row(*rays_->mutable_t_max(), rows_before, t_max, std::numeric_limits<float>::infinity());
  filter_row(rows_before, filter);
  return *this;
}

RayBlock& RayBlock::rays(absl::Span<const float> origins, absl::Span<const float> directions) {
  append(*rays_->mutable_origins(), origins);
  append(*rays_->mutable_directions(), directions);
  return *this;
}

RayBlock& RayBlock::rotation(const Rotation& rotation) {
  block_->clear_rotation();
  append_rotation(*block_->mutable_rotation(), rotation);
  return *this;
}

RayBlock& RayBlock::t_max(absl::Span<const float> t_max) {
  assign(*rays_->mutable_t_max(), t_max);
  return *this;
}

RayBlock& RayBlock::after(absl::Span<const float> ts, absl::Span<const uint64_t> ids,
                          absl::Span<const uint32_t> triangles) {
  set_after(*rays_, ts, ids, triangles);
  return *this;
}

BallBlock& BallBlock::detail(v1::StaticDetail detail) {
  balls_->set_detail(detail);
  return *this;
}

BallBlock& BallBlock::ball(const Float3& center, float radius, const Filter& filter) {
  filter_row(balls_->centers_size() / 3, filter);
  append_triple(*balls_->mutable_centers(), center);
  balls_->add_radii(radius);
  return *this;
}

BallBlock& BallBlock::balls(absl::Span<const float> centers, absl::Span<const float> radii) {
  append(*balls_->mutable_centers(), centers);
  append(*balls_->mutable_radii(), radii);
  return *this;
}

BoxBlock& BoxBlock::detail(v1::StaticDetail detail) {
  boxes_->set_detail(detail);
  return *this;
}

BoxBlock& BoxBlock::box(const Float3& center, const Float3& half_extents, const Rotation& rotation,
                        const Filter& filter) {
  const int rows_before = boxes_->centers_size() / 3;
  append_triple(*boxes_->mutable_centers(), center);
  append_triple(*boxes_->mutable_half_extents(), half_extents);
  append_rotation_row(*boxes_->mutable_rotations(), rows_before, rotation);
  filter_row(rows_before, filter);
  return *this;
}

BoxBlock& BoxBlock::boxes(absl::Span<const float> centers, absl::Span<const float> half_extents) {
  append(*boxes_->mutable_centers(), centers);
  append(*boxes_->mutable_half_extents(), half_extents);
  return *this;
}

BoxBlock& BoxBlock::rotations(absl::Span<const float> rotations) {
  assign(*boxes_->mutable_rotations(), rotations);
  return *this;
}

CapsuleBlock& CapsuleBlock::detail(v1::StaticDetail detail) {
  capsules_->set_detail(detail);
  return *this;
}

CapsuleBlock& CapsuleBlock::capsule(const Float3& start, const Float3& end, float radius, const Filter& filter) {
  filter_row(capsules_->starts_size() / 3, filter);
  append_triple(*capsules_->mutable_starts(), start);
  append_triple(*capsules_->mutable_ends(), end);
  capsules_->add_radii(radius);
  return *this;
}

CapsuleBlock& CapsuleBlock::capsules(absl::Span<const float> starts, absl::Span<const float> ends,
                                     absl::Span<const float> radii) {
  append(*capsules_->mutable_starts(), starts);
  append(*capsules_->mutable_ends(), ends);
  append(*capsules_->mutable_radii(), radii);
  return *this;
}

SweepBlock& SweepBlock::mode(v1::RayMode mode) {
  sweeps_->set_mode(mode);
  return *this;
}

SweepBlock& SweepBlock::at_start(v1::AtStart at_start) {
  sweeps_->set_at_start(at_start);
  return *this;
}

int SweepBlock::append_path(const Float3& start, const Float3& end, const Filter& filter) {
  const int rows_before = sweeps_->starts_size() / 3;
  append_triple(*sweeps_->mutable_starts(), start);
  append_triple(*sweeps_->mutable_ends(), end);
  filter_row(rows_before, filter);
  return rows_before;
}

SweepBlock& SweepBlock::ball(const Float3& start, const Float3& end, float radius, const Filter& filter) {
  append_path(start, end, filter);
  sweeps_->add_radii(radius);
  return *this;
}

SweepBlock& SweepBlock::capsule(const Float3& start, const Float3& end, const Float3& half_axis, float radius,
                                const Filter& filter) {
  append_triple(*sweeps_->mutable_half_axes(), half_axis);
  return ball(start, end, radius, filter);
}

SweepBlock& SweepBlock::box(const Float3& start, const Float3& end, const Float3& half_extents,
                            const Rotation& rotation, const Filter& filter) {
  append_triple(*sweeps_->mutable_half_extents(), half_extents);
  append_rotation_row(*sweeps_->mutable_rotations(), append_path(start, end, filter), rotation);
  return *this;
}

SweepBlock& SweepBlock::sweeps(absl::Span<const float> starts, absl::Span<const float> ends) {
  append(*sweeps_->mutable_starts(), starts);
  append(*sweeps_->mutable_ends(), ends);
  return *this;
}

SweepBlock& SweepBlock::radii(absl::Span<const float> radii) {
  assign(*sweeps_->mutable_radii(), radii);
  return *this;
}

SweepBlock& SweepBlock::half_axes(absl::Span<const float> half_axes) {
  assign(*sweeps_->mutable_half_axes(), half_axes);
  return *this;
}

SweepBlock& SweepBlock::half_extents(absl::Span<const float> half_extents) {
  assign(*sweeps_->mutable_half_extents(), half_extents);
  return *this;
}

SweepBlock& SweepBlock::rotations(absl::Span<const float> rotations) {
  assign(*sweeps_->mutable_rotations(), rotations);
  return *this;
}

NearestBlock& NearestBlock::k(uint32_t count) {
  nearest_->set_k(count);
  return *this;
}

NearestBlock& NearestBlock::detail(v1::StaticDetail detail) {
  nearest_->set_detail(detail);
  return *this;
}

NearestBlock& NearestBlock::point(const Float3& point, float max_distance, const Filter& filter) {
  const int rows_before = nearest_->points_size() / 3;
  append_triple(*nearest_->mutable_points(), point);
  append_row(*nearest_->mutable_max_distances(), rows_before, max_distance, std::numeric_limits<float>::infinity());
  filter_row(rows_before, filter);
  return *this;
}

NearestBlock& NearestBlock::points(absl::Span<const float> points) {
  append(*nearest_->mutable_points(), points);
  return *this;
}

NearestBlock& NearestBlock::max_distances(absl::Span<const float> distances) {
  assign(*nearest_->mutable_max_distances(), distances);
  return *this;
}

NearestBlock& NearestBlock::after(absl::Span<const float> ts, absl::Span<const uint64_t> ids,
                                  absl::Span<const uint32_t> triangles) {
  set_after(*nearest_, ts, ids, triangles);
  return *this;
}

FrustumBlock& FrustumBlock::detail(v1::StaticDetail detail) {
  frustums_->set_detail(detail);
  return *this;
}

FrustumBlock& FrustumBlock::planes(absl::Span<const float> planes, uint32_t planes_each) {
  append(*frustums_->mutable_planes(), planes);
  frustums_->set_planes_each(planes_each);
  return *this;
}

FrustumBlock& FrustumBlock::view_projections(absl::Span<const float> matrices, v1::ClipDepth clip_depth) {
  append(*frustums_->mutable_view_projections(), matrices);
  frustums_->set_clip_depth(clip_depth);
  return *this;
}

ContainsBlock& ContainsBlock::point(const Float3& point, const Filter& filter) {
  filter_row(contains_->points_size() / 3, filter);
  append_triple(*contains_->mutable_points(), point);
  return *this;
}

ContainsBlock& ContainsBlock::points(absl::Span<const float> points) {
  append(*contains_->mutable_points(), points);
  return *this;
}

SightBlock& SightBlock::viewer(const Float3& eye, uint64_t group) {
  append_row<uint64_t>(*sight_->mutable_viewer_groups(), sight_->viewers_size() / 3, group, 0);
  append_triple(*sight_->mutable_viewers(), eye);
  return *this;
}

SightBlock& SightBlock::target(const Float3& sample, uint64_t group) {
  append_row<uint64_t>(*sight_->mutable_target_groups(), sight_->targets_size() / 3, group, 0);
  append_triple(*sight_->mutable_targets(), sample);
  return *this;
}

SightBlock& SightBlock::viewers(absl::Span<const float> points, uint32_t eyes) {
  append(*sight_->mutable_viewers(), points);
  sight_->set_eyes_per_viewer(eyes);
  return *this;
}

SightBlock& SightBlock::targets(absl::Span<const float> points, uint32_t samples) {
  append(*sight_->mutable_targets(), points);
  sight_->set_samples_per_target(samples);
  return *this;
}

SightBlock& SightBlock::viewer_groups(absl::Span<const uint64_t> groups) {
  assign(*sight_->mutable_viewer_groups(), groups);
  return *this;
}

SightBlock& SightBlock::target_groups(absl::Span<const uint64_t> groups) {
  assign(*sight_->mutable_target_groups(), groups);
  return *this;
}

SightBlock& SightBlock::max_distances(absl::Span<const float> distances) {
  assign(*sight_->mutable_max_distances(), distances);
  return *this;
}

SightBlock& SightBlock::pairwise() {
  sight_->set_pairwise(true);
  return *this;
}

PairBlock& PairBlock::max_distance(float distance) {
  pairs_->set_max_distance(distance);
  return *this;
}

PairBlock& PairBlock::layers(uint32_t first_mask, uint32_t second_mask) {
  pairs_->set_first_mask(first_mask);
  pairs_->set_second_mask(second_mask);
  return *this;
}

PairBlock& PairBlock::k(uint32_t count) {
  pairs_->set_k(count);
  return *this;
}

PairBlock& PairBlock::after_pair(uint64_t id, uint64_t other) {
  block_->set_after_id(id);
  pairs_->set_after_other(other);
  return *this;
}

CellBlock& CellBlock::max_planes(uint32_t planes) {
  cells_->set_max_planes(planes);
  return *this;
}

CellBlock& CellBlock::point(const Float3& point, float max_distance, const Filter& filter) {
  filter_row(cells_->points_size() / 3, filter);
  append_triple(*cells_->mutable_points(), point);
  cells_->add_max_distances(max_distance);
  return *this;
}

CellBlock& CellBlock::points(absl::Span<const float> points, absl::Span<const float> max_distances) {
  append(*cells_->mutable_points(), points);
  append(*cells_->mutable_max_distances(), max_distances);
  return *this;
}

LookupBlock& LookupBlock::id(uint64_t id) {
  lookup_->add_ids(id);
  return *this;
}

LookupBlock& LookupBlock::ids(absl::Span<const uint64_t> ids) {
  append(*lookup_->mutable_ids(), ids);
  return *this;
}

LookupBlock& LookupBlock::group(uint64_t group) {
  lookup_->add_groups(group);
  return *this;
}

}  // namespace locus::client
