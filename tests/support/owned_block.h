// A block of queries that owns its columns, and comparison of two results. Used by tests of queries.
#ifndef LOCUS_TESTS_SUPPORT_OWNED_BLOCK_H_
#define LOCUS_TESTS_SUPPORT_OWNED_BLOCK_H_

#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "tests/support/run_batch.h"

namespace locus::test {

// Block that owns its columns. `settings` holds all other members of the block; its kind determines which of the
// columns are used.
struct OwnedBlock {
  QueryBlock settings;
  // Origins of rays, centres of balls and boxes, starts of capsules and sweeps, points of nearest, contains and cells,
  // eyes of sight, or planes of frustums.
  std::vector<float> points;
  // Directions of rays, radii of balls, half extents of boxes, ends of capsules and sweeps, or targets of sight.
  std::vector<float> sizes;
  // t_max of rays, rotations of boxes, radii of capsules and sweeps, maximum distances of nearest, cells and sight, or
  // matrices of frustums.
  std::vector<float> extras;
  std::vector<float> half_axes;         // sweeps
  std::vector<float> half_extents;      // sweeps
  std::vector<float> rotations;         // sweeps
  std::vector<uint64_t> ids;            // ids of lookups
  std::vector<uint64_t> groups;         // groups of lookups, or of the viewers of sight
  std::vector<uint64_t> target_groups;  // sight
  std::vector<float> after_ts;          // rays and nearest
  std::vector<uint64_t> after_ids;
  std::vector<uint32_t> after_triangles;
  std::vector<uint64_t> anchor_ids;
  std::vector<uint32_t> masks;
  std::vector<uint64_t> ignore_groups;
  std::vector<uint64_t> ignore_ids;
  std::vector<uint64_t> only_groups;  // settings.only_groups_each has their number per query
  std::vector<uint64_t> tags;
  std::vector<uint64_t> tag_masks;
  std::vector<uint64_t> self_ids;
  std::vector<float> rotation;  // rays: one quaternion
  std::vector<uint64_t> as_of_ticks;
  std::vector<float> as_of_fractions;

  // Returns a block that borrows from this block.
  QueryBlock view() const {
    QueryBlock block = settings;
    block.masks = masks;
    block.ignore_groups = ignore_groups;
    block.ignore_ids = ignore_ids;
    block.only_groups = only_groups;
    block.tags = tags;
    block.tag_masks = tag_masks;
    block.self_ids = self_ids;
    block.rotation = rotation;
    block.anchor_ids = anchor_ids;
    block.as_of_ticks = as_of_ticks;
    block.as_of_fractions = as_of_fractions;
    std::visit([this](auto& kind) { fill(kind); }, block.kind);
    return block;
  }

  // Returns a block of the queries `begin` to `end` - 1. Columns with one entry for all queries are copied unchanged.
  OwnedBlock part(size_t begin, size_t end) const {
    const size_t n = query_count(view());
    OwnedBlock part = *this;
    part.for_each_column([&](auto& column, size_t width) {
      if (column.size() != n * width || n == 1) return;
      column = {column.begin() + static_cast<std::ptrdiff_t>(begin * width),
                column.begin() + static_cast<std::ptrdiff_t>(end * width)};
    });
    return part;
  }

  // Calls visit(column, width) for each column; `width` is the number of values that the column has for each query.
  template <class Visit>
  void for_each_column(const Visit& visit) {
    const QueryBlock::Kind& kind = settings.kind;
    const auto* const frustums = std::get_if<FrustumColumns>(&kind);
    const auto* const sight = std::get_if<SightColumns>(&kind);
    const size_t points_each = sight == nullptr ? 1 : sight->eyes_per_viewer();
    visit(points, frustums == nullptr ? 3 * points_each : 4 * frustums->planes_per_region());
    if (sight == nullptr) {
      visit(sizes, std::holds_alternative<BallColumns>(kind) ? 1 : 3);
    } else if (sight->pairwise) {
      visit(sizes, 3 * sight->samples_per_target());
      visit(target_groups, 1);
    }
    visit(extras, std::holds_alternative<BoxColumns>(kind) ? 4 : frustums == nullptr ? 1 : 16);
    visit(half_axes, 3);
    visit(half_extents, 3);
    visit(rotations, 4);
    for (auto* column :
         {&ids, &groups, &after_ids, &anchor_ids, &ignore_groups, &as_of_ticks, &tags, &tag_masks, &self_ids})
      visit(*column, 1);
    visit(only_groups, settings.only_groups_per_query());
    for (auto* column : {&after_triangles, &masks}) visit(*column, 1);
    for (auto* column : {&after_ts, &as_of_fractions}) visit(*column, 1);
  }

 private:
  void fill(RayColumns& rays) const {
    rays.origins = points;
    rays.directions = sizes;
    rays.t_max = extras;
    rays.after = {after_ts, after_ids, after_triangles};
  }
  void fill(BallColumns& balls) const {
    balls.centers = points;
    balls.radii = sizes;
  }
  void fill(BoxColumns& boxes) const {
    boxes.centers = points;
    boxes.half_extents = sizes;
    boxes.rotations = extras;
  }
  void fill(CapsuleColumns& capsules) const {
    capsules.starts = points;
    capsules.ends = sizes;
    capsules.radii = extras;
  }
  void fill(SweepColumns& sweeps) const {
    sweeps.starts = points;
    sweeps.ends = sizes;
    sweeps.radii = extras;
    sweeps.half_axes = half_axes;
    sweeps.half_extents = half_extents;
    sweeps.rotations = rotations;
  }
  void fill(NearestColumns& nearest) const {
    nearest.points = points;
    nearest.max_distances = extras;
    nearest.after = {after_ts, after_ids, after_triangles};
  }
  void fill(FrustumColumns& frustums) const {
    frustums.planes = points;
    frustums.view_projections = extras;
  }
  void fill(SightColumns& sight) const {
    sight.viewers = points;
    sight.viewer_groups = groups;
    sight.targets = sizes;
    sight.target_groups = target_groups;
    sight.max_distances = extras;
  }
  void fill(ContainsColumns& contains) const { contains.points = points; }
  void fill(PairColumns& /*pairs*/) const {}
  void fill(CellColumns& cells) const {
    cells.points = points;
    cells.max_distances = extras;
  }
  void fill(LookupColumns& lookup) const {
    lookup.ids = ids;
    lookup.groups = groups;
  }
};

// Returns a batch that borrows from `blocks`. `blocks` must outlive the batch, so a temporary vector is rejected at
// compile time.
QueryBatch batch_of(std::vector<OwnedBlock>&& blocks) = delete;
inline QueryBatch batch_of(const std::vector<OwnedBlock>& blocks) {
  QueryBatch batch;
  for (const OwnedBlock& block : blocks) batch.blocks.push_back(block.view());
  return batch;
}

// Runs a block as a batch and returns its result. Precondition: check_batch() accepts the block.
inline BlockResult run_block(const SceneSnapshot& snapshot, const OwnedBlock& block, const RunOptions& options = {}) {
  QueryBatch batch;
  batch.blocks = {block.view()};
  LOCUS_CHECK_EQ(check_batch(batch).ToString(), "OK");
  auto result = run_batch(snapshot, batch, options);
  LOCUS_CHECK(result.ok());
  return std::move(result->blocks[0]);
}

namespace internal {
template <class Column>
std::string column_difference(const char* name, const Column& got, const Column& expected) {
  const std::string column = std::string(name) + " ";
  if (got.size() != expected.size())
    return column + "has " + std::to_string(got.size()) + " numbers, not " + std::to_string(expected.size());
  for (size_t i = 0; i < got.size(); ++i) {
    if (std::memcmp(&got[i], &expected[i], sizeof(got[i])) != 0)
      return column + std::to_string(i) + ": " + std::to_string(got[i]) + ", not " + std::to_string(expected[i]);
  }
  return "";
}
}  // namespace internal

// Returns the first column and the first index at which two results differ in any bit; empty if they are equal. Does
// not compare the work.
inline std::string difference(const BlockResult& got, const BlockResult& expected) {
  using internal::column_difference;
  for (std::string what : {column_difference("counts", got.counts, expected.counts),
                           column_difference("truncated", got.truncated, expected.truncated),
                           column_difference("hits", got.hits, expected.hits),
                           column_difference("matrix", got.matrix, expected.matrix),
                           column_difference("others", got.others, expected.others),
                           column_difference("unanchored", got.unanchored, expected.unanchored),
                           column_difference("ids", got.ids, expected.ids),
                           column_difference("triangles", got.triangles, expected.triangles),
                           column_difference("t", got.t, expected.t),
                           column_difference("uvs", got.uvs, expected.uvs),
                           column_difference("normals", got.normals, expected.normals),
                           column_difference("points", got.points, expected.points),
                           column_difference("groups", got.groups, expected.groups),
                           column_difference("tags", got.tags, expected.tags),
                           column_difference("layers", got.layers, expected.layers),
                           column_difference("positions", got.positions, expected.positions),
                           column_difference("rotations", got.rotations, expected.rotations),
                           column_difference("resolved_ticks", got.resolved_ticks, expected.resolved_ticks),
                           column_difference("resolved_fractions", got.resolved_fractions, expected.resolved_fractions),
                           column_difference("clamped", got.clamped, expected.clamped)}) {
    if (!what.empty()) return what;
  }
  return "";
}

inline std::string difference(const BatchResult& got, const BatchResult& expected) {
  if (got.blocks.size() != expected.blocks.size()) return "another number of blocks";
  for (size_t i = 0; i < got.blocks.size(); ++i) {
    const std::string what = difference(got.blocks[i], expected.blocks[i]);
    if (!what.empty()) return "block " + std::to_string(i) + ", " + what;
  }
  return "";
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_OWNED_BLOCK_H_
