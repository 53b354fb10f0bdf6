// Builders of one block of a query batch: rays, balls, boxes, capsules, sweeps, frustums, contains, sight, nearest,
// pairs, cells or lookup, with the settings that all kinds share. QueryBuilder returns these builders; they are valid
// until QueryBuilder::build(). The builders check nothing: if a value is invalid, the server refuses the whole batch
// with an error that names block, column and index. Not thread-safe.
//
// Let N be the number of queries of a block. A per-query column (t_max, max_distances, masks, groups, tags, self ids,
// rotations) is either filled row by row, or set as a whole column, which has N entries, one entry for all queries, or
// no entries. Do not fill one column of a block both row by row and as a whole.
#ifndef LOCUS_CLIENT_LIB_QUERY_BLOCKS_H_
#define LOCUS_CLIENT_LIB_QUERY_BLOCKS_H_

#include <cstdint>
#include <limits>
#include <optional>

#include "absl/types/span.h"
#include "client/lib/columns.h"
#include "client/lib/values.h"
#include "locus/v1/query_service.pb.h"

namespace locus::client {

inline constexpr uint32_t kEveryMask = 0xFFFFFFFFu;

// Filter of one query by layers, group, id and tag. An object or instance is found only if it passes all of them.
struct Filter {
  uint32_t mask = kEveryMask;  // finds only objects and instances with (layers & mask) != 0
  uint64_t ignore_group = 0;   // group that the query does not find; 0 = no group is ignored
  uint64_t only_group = 0;     // only group that the query finds; 0 = every group
  uint64_t self_id = 0;        // id that the query does not find; 0 = no id
  // Finds only objects and instances with (their tag & tag_mask) == (tag & tag_mask); none = every tag.
  std::optional<uint64_t> tag = std::nullopt;
  uint64_t tag_mask = ~uint64_t{0};
};

// Settings that every kind of block has. Each function returns the builder of the block, so that calls can be chained.
template <class Derived>
class BlockBuilder {
 public:
  // Sets the frame: the origin that the server adds to every position of the block. Points in the block's result are
  // relative to the frame, but poses are absolute.
  Derived& frame(const Double3& origin) {
    v1::Vec3d& frame = *block_->mutable_frame();
    frame.set_x(origin.x);
    frame.set_y(origin.y);
    frame.set_z(origin.z);
    return derived();
  }
  Derived& source(v1::Source source) {
    block_->set_source(source);
    return derived();
  }
  Derived& precision(v1::Precision precision) {
    block_->set_precision(precision);
    return derived();
  }
  Derived& columns(absl::Span<const v1::Column> columns) {
    block_->clear_columns();
    for (const v1::Column column : columns) block_->add_columns(column);
    return derived();
  }
  Derived& masks(absl::Span<const uint32_t> masks) {
    assign(*block_->mutable_masks(), masks);
    return derived();
  }
  Derived& ignore_groups(absl::Span<const uint64_t> groups) {
    assign(*block_->mutable_ignore_groups(), groups);
    return derived();
  }
  // Sets the ids that all queries of the block ignore, at most 64 ids.
  Derived& ignore_ids(absl::Span<const uint64_t> ids) {
    assign(*block_->mutable_ignore_ids(), ids);
    return derived();
  }
  // Restricts each query to the members of some groups: `each` groups (1 .. 16) for each of N queries, or `each` groups
  // for all queries. A group 0 is no group; it fills an entry that has fewer groups.
  Derived& only_groups(absl::Span<const uint64_t> groups, uint32_t each = 1) {
    assign(*block_->mutable_only_groups(), groups);
    block_->set_only_groups_each(each);
    return derived();
  }
  // Restricts each query to objects and instances with (tag & mask) == (entry of `tags` & mask). `tags` has N entries
  // or one for all queries. `masks` has N entries, one for all queries, or none, which compares all bits.
  Derived& tags(absl::Span<const uint64_t> tags, absl::Span<const uint64_t> masks = {}) {
    assign(*block_->mutable_tags(), tags);
    assign(*block_->mutable_tag_masks(), masks);
    return derived();
  }
  // Sets the id that each query does not find, such as the object from which the query starts; 0 = no id.
  Derived& self_ids(absl::Span<const uint64_t> ids) {
    assign(*block_->mutable_self_ids(), ids);
    return derived();
  }
  // Sets the maximum number of rows per query; 0 = the default of 1,024.
  Derived& max_results(uint32_t rows) {
    block_->set_max_results(rows);
    return derived();
  }
  // Restricts the result to rows whose id is greater than `id`, to continue after a truncated result.
  Derived& after_id(uint64_t id) {
    block_->set_after_id(id);
    return derived();
  }
  // Sets the anchor of each query: N ids of objects or instances, or one for all queries. The positions of a query are
  // relative to the position of its anchor, and the query does not find its anchor. Points in the result stay relative
  // to the frame.
  Derived& anchors(absl::Span<const uint64_t> ids) {
    assign(*block_->mutable_anchor_ids(), ids);
    return derived();
  }
  // Requests only the number of rows of each query; max_results() does not limit this number.
  Derived& count_only() {
    block_->set_count_only(true);
    return derived();
  }
  // Sets the time of each query. `ticks` has N entries or one for all queries. `fractions` has N entries, one for all
  // queries, or none. A fraction is the share of the time from the query's tick to the next tick, at least 0 and less
  // than 1.
  Derived& as_of(absl::Span<const uint64_t> ticks, absl::Span<const float> fractions = {}) {
    assign(*block_->mutable_as_of_ticks(), ticks);
    assign(*block_->mutable_as_of_fractions(), fractions);
    return derived();
  }
  // Sets how times outside the recorded history are handled; by default the server refuses them.
  Derived& outside_history(v1::OutsideHistory outside) {
    block_->set_outside_history(outside);
    return derived();
  }

 protected:
  explicit BlockBuilder(v1::QueryBlock& block) : block_(&block) {}

  void filter_row(int rows_before, const Filter& filter) {
    append_row<uint32_t>(*block_->mutable_masks(), rows_before, filter.mask, kEveryMask);
    append_row<uint64_t>(*block_->mutable_ignore_groups(), rows_before, filter.ignore_group, 0);
    append_row<uint64_t>(*block_->mutable_only_groups(), rows_before, filter.only_group, 0);
    append_row<uint64_t>(*block_->mutable_self_ids(), rows_before, filter.self_id, 0);
    // The server takes masks only together with tags, so both columns are filled once a row has a mask.
    append_row<uint64_t>(*block_->mutable_tag_masks(), rows_before, filter.tag ? filter.tag_mask : 0, 0);
    if (!block_->tag_masks().empty()) {
      block_->mutable_tags()->Resize(rows_before, 0);
      block_->add_tags(filter.tag.value_or(0));
    }
  }

  v1::QueryBlock* block_;

 private:
  Derived& derived() { return static_cast<Derived&>(*this); }
};

class RayBlock : public BlockBuilder<RayBlock> {
 public:
  explicit RayBlock(v1::QueryBlock& block) : BlockBuilder(block), rays_(block.mutable_rays()) {}

  RayBlock& mode(v1::RayMode mode);
  RayBlock& cull(v1::Cull cull);
  RayBlock& inside(v1::Inside inside);
  // Appends one ray. The direction may have any length except zero; this length is the unit of t.
  RayBlock& ray(const Float3& origin, const Float3& direction, float t_max = std::numeric_limits<float>::infinity(),
                const Filter& filter = {});
  // Appends N rays: 3N floats of origins and 3N floats of directions. If this call adds all rays of the block,
  // `origins` or `directions` may instead contain three floats for all rays.
  RayBlock& rays(absl::Span<const float> origins, absl::Span<const float> directions);
  // Rotates the directions of all rays of the block, but not their origins. A sensor sends its pattern of directions
  // unchanged, with the rotation and the one origin of the moment.
  RayBlock& rotation(const Rotation& rotation);
  // Sets the whole column of the maximum t, inclusive: N entries, or one for all rays.
  RayBlock& t_max(absl::Span<const float> t_max);
  // Restricts the result to hits that follow (t, id, triangle) in the order of rows. Used to continue after a truncated
  // result. Each column has N entries, or one for all rays. Without `ids`, hits whose t equals the given t are left
  // out.
  RayBlock& after(absl::Span<const float> ts, absl::Span<const uint64_t> ids = {},
                  absl::Span<const uint32_t> triangles = {});

 private:
  v1::Rays* rays_;
};

class BallBlock : public BlockBuilder<BallBlock> {
 public:
  explicit BallBlock(v1::QueryBlock& block) : BlockBuilder(block), balls_(block.mutable_balls()) {}

  BallBlock& detail(v1::StaticDetail detail);
  BallBlock& ball(const Float3& center, float radius, const Filter& filter = {});
  // Appends N balls: 3N floats of centers, and N radii. If this call adds all balls of the block, `radii` may instead
  // contain one radius for all balls.
  BallBlock& balls(absl::Span<const float> centers, absl::Span<const float> radii);

 private:
  v1::Balls* balls_;
};

class BoxBlock : public BlockBuilder<BoxBlock> {
 public:
  explicit BoxBlock(v1::QueryBlock& block) : BlockBuilder(block), boxes_(block.mutable_boxes()) {}

  BoxBlock& detail(v1::StaticDetail detail);
  BoxBlock& box(const Float3& center, const Float3& half_extents, const Rotation& rotation = {},
                const Filter& filter = {});
  // Appends N boxes: 3N floats of centers, and 3N floats of half extents. If this call adds all boxes of the block,
  // `half_extents` may instead contain three floats for all boxes.
  BoxBlock& boxes(absl::Span<const float> centers, absl::Span<const float> half_extents);
  // Sets the whole column of rotations: N quaternions (4N floats: x, y, z, w), or one for all boxes.
  BoxBlock& rotations(absl::Span<const float> rotations);

 private:
  v1::Boxes* boxes_;
};

class CapsuleBlock : public BlockBuilder<CapsuleBlock> {
 public:
  explicit CapsuleBlock(v1::QueryBlock& block) : BlockBuilder(block), capsules_(block.mutable_capsules()) {}

  CapsuleBlock& detail(v1::StaticDetail detail);
  // Appends a capsule: all points at a distance of at most `radius` from the segment from `start` to `end`.
  CapsuleBlock& capsule(const Float3& start, const Float3& end, float radius, const Filter& filter = {});
  // Appends N capsules: 3N floats of starts, 3N floats of ends, and N radii. If this call adds all capsules of the
  // block, `ends` may instead contain three floats for all capsules, and `radii` one radius for all.
  CapsuleBlock& capsules(absl::Span<const float> starts, absl::Span<const float> ends, absl::Span<const float> radii);

 private:
  v1::Capsules* capsules_;
};

// Sweeps: solids that move in a straight line from a start to an end. All solids of a block are of one kind: balls,
// capsules or boxes. Default mode: FIRST.
class SweepBlock : public BlockBuilder<SweepBlock> {
 public:
  explicit SweepBlock(v1::QueryBlock& block) : BlockBuilder(block), sweeps_(block.mutable_sweeps()) {}

  SweepBlock& mode(v1::RayMode mode);
  // Sets how objects and triangles that the solid touches at its start are treated; by default they are hits at t = 0.
  SweepBlock& at_start(v1::AtStart at_start);
  // Append a ball, a capsule or a box whose centre moves from `start` to `end`. `half_axis` is the vector from the
  // centre of the capsule to one end of its inner segment.
  SweepBlock& ball(const Float3& start, const Float3& end, float radius, const Filter& filter = {});
  SweepBlock& capsule(const Float3& start, const Float3& end, const Float3& half_axis, float radius,
                      const Filter& filter = {});
  SweepBlock& box(const Float3& start, const Float3& end, const Float3& half_extents, const Rotation& rotation = {},
                  const Filter& filter = {});
  // Appends N sweeps: 3N floats of starts and 3N floats of ends; if this call adds all sweeps of the block, `ends` may
  // instead contain three floats for all. The solids are set by the functions below.
  SweepBlock& sweeps(absl::Span<const float> starts, absl::Span<const float> ends);
  // Set the columns that describe the moving solids: N entries, or one for all sweeps. Balls need radii. Capsules need
  // radii and half axes (three floats each). Boxes need half extents (three floats each) and may have rotations (unit
  // quaternions, four floats each: x, y, z, w).
  SweepBlock& radii(absl::Span<const float> radii);
  SweepBlock& half_axes(absl::Span<const float> half_axes);
  SweepBlock& half_extents(absl::Span<const float> half_extents);
  SweepBlock& rotations(absl::Span<const float> rotations);

 private:
  // Appends the start, end and filter of a sweep of any solid. Returns the number of sweeps that the block had
  // before.
  int append_path(const Float3& start, const Float3& end, const Filter& filter);

  v1::Sweeps* sweeps_;
};

// Block that finds the objects and instances nearest to points. The rows of a query ascend by distance, which is in
// column t.
class NearestBlock : public BlockBuilder<NearestBlock> {
 public:
  explicit NearestBlock(v1::QueryBlock& block) : BlockBuilder(block), nearest_(block.mutable_nearest()) {}

  // Sets the maximum number of rows per point, up to 65,536; 0 means 1.
  NearestBlock& k(uint32_t count);
  // Sets whether a row is an instance or a triangle. INSTANCES reports an instance once, with its nearest triangle.
  NearestBlock& detail(v1::StaticDetail detail);
  NearestBlock& point(const Float3& point, float max_distance = std::numeric_limits<float>::infinity(),
                      const Filter& filter = {});
  // Appends N points: 3N floats.
  NearestBlock& points(absl::Span<const float> points);
  // Sets the whole column of maximum distances, inclusive: N entries, or one for all points.
  NearestBlock& max_distances(absl::Span<const float> distances);
  // Restricts the result to rows that follow (distance, id, triangle). The parameters are those of RayBlock::after().
  NearestBlock& after(absl::Span<const float> ts, absl::Span<const uint64_t> ids = {},
                      absl::Span<const uint32_t> triangles = {});

 private:
  v1::Nearest* nearest_;
};

// Block that finds the objects and instances that overlap convex regions. Either all regions of a block are given by
// planes, or all by view-projection matrices.
class FrustumBlock : public BlockBuilder<FrustumBlock> {
 public:
  explicit FrustumBlock(v1::QueryBlock& block) : BlockBuilder(block), frustums_(block.mutable_frustums()) {}

  FrustumBlock& detail(v1::StaticDetail detail);
  // Appends regions of `planes_each` planes, 4 .. 32. A plane is four floats nx, ny, nz, d, and a point p is inside the
  // plane if n.p + d >= 0. All regions of a block have the same number of planes.
  FrustumBlock& planes(absl::Span<const float> planes, uint32_t planes_each = 6);
  // Appends the views of cameras: column-major matrices of 16 floats, which map positions to clip coordinates.
  FrustumBlock& view_projections(absl::Span<const float> matrices,
                                 v1::ClipDepth clip_depth = v1::CLIP_DEPTH_ZERO_TO_ONE);

 private:
  v1::Frustums* frustums_;
};

// Block that finds the objects and closed meshes that contain points.
class ContainsBlock : public BlockBuilder<ContainsBlock> {
 public:
  explicit ContainsBlock(v1::QueryBlock& block) : BlockBuilder(block), contains_(block.mutable_contains()) {}

  ContainsBlock& point(const Float3& point, const Filter& filter = {});
  // Appends N points: 3N floats.
  ContainsBlock& points(absl::Span<const float> points);

 private:
  v1::Contains* contains_;
};

// Block that finds the targets that each viewer sees. Settings with one entry per query, such as masks, have one entry
// per viewer here.
class SightBlock : public BlockBuilder<SightBlock> {
 public:
  explicit SightBlock(v1::QueryBlock& block) : BlockBuilder(block), sight_(block.mutable_sight()) {}

  // Append a viewer with one eye, or a target with one sample point. Objects and instances of the viewer's or target's
  // `group` do not block the sight between the two; group 0 = none.
  SightBlock& viewer(const Float3& eye, uint64_t group = 0);
  SightBlock& target(const Float3& sample, uint64_t group = 0);
  // Append viewers of `eyes` eyes, 1 .. 16, and targets of `samples` sample points, 1 .. 255: three floats for each
  // point. All viewers of a block have the same number of eyes, all targets the same number of samples.
  SightBlock& viewers(absl::Span<const float> points, uint32_t eyes = 1);
  SightBlock& targets(absl::Span<const float> points, uint32_t samples = 1);
  // Set the whole column of groups: an entry for each viewer or target, or one for all.
  SightBlock& viewer_groups(absl::Span<const uint64_t> groups);
  SightBlock& target_groups(absl::Span<const uint64_t> groups);
  // Sets the whole column of maximum distances of sight, inclusive: an entry for each viewer, or one for all.
  SightBlock& max_distances(absl::Span<const float> distances);
  // Makes viewer i look only at target i, instead of making every viewer look at every target.
  SightBlock& pairwise();

 private:
  v1::Sight* sight_;
};

// Block that finds pairs of objects near each other. The whole block is one query.
class PairBlock : public BlockBuilder<PairBlock> {
 public:
  explicit PairBlock(v1::QueryBlock& block) : BlockBuilder(block), pairs_(block.mutable_pairs()) {}

  // Sets the maximum distance between the solids, inclusive; 0 finds objects that touch.
  PairBlock& max_distance(float distance);
  // Sets the layers of the first and of the second object; by default all layers.
  PairBlock& layers(uint32_t first_mask, uint32_t second_mask);
  // Requests the `count` nearest objects of each first object, instead of all pairs.
  PairBlock& k(uint32_t count);
  // Restricts the result to pairs that follow (id, other), to continue after a truncated result.
  PairBlock& after_pair(uint64_t id, uint64_t other);

 private:
  v1::Pairs* pairs_;
};

// Block that finds the convex free space around points.
class CellBlock : public BlockBuilder<CellBlock> {
 public:
  explicit CellBlock(v1::QueryBlock& block) : BlockBuilder(block), cells_(block.mutable_cells()) {}

  // Sets the maximum number of planes that bound a space, up to 64; 0 = 32.
  CellBlock& max_planes(uint32_t planes);
  // Appends a point. The answer is the free space around the point, at most `max_distance` in radius.
  CellBlock& point(const Float3& point, float max_distance, const Filter& filter = {});
  // Appends N points: 3N floats, and N maximum distances. If this call adds all points of the block, `max_distances`
  // may instead contain one distance for all points.
  CellBlock& points(absl::Span<const float> points, absl::Span<const float> max_distances);

 private:
  v1::Cells* cells_;
};

// Block that looks up objects and instances, either by ids or by groups. A lookup by ids returns one row for each id,
// in the order of the ids.
class LookupBlock : public BlockBuilder<LookupBlock> {
 public:
  explicit LookupBlock(v1::QueryBlock& block) : BlockBuilder(block), lookup_(block.mutable_lookup()) {}

  LookupBlock& id(uint64_t id);
  LookupBlock& ids(absl::Span<const uint64_t> ids);
  LookupBlock& group(uint64_t group);

 private:
  v1::Lookup* lookup_;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_QUERY_BLOCKS_H_
