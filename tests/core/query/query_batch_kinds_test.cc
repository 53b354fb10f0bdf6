// Tests refusals of invalid columns: those of frustums, sight, contains, pairs and cells, and those of anchors, counts
// and pages. Each error names the field and, if the field's value at one index is wrong, this index.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "core/base/refusal.h"
#include "core/query/query_batch.h"
#include "tests/support/owned_block.h"
#include "tests/support/special_floats.h"

namespace locus::test {
namespace {

// Expects that check_batch() refuses the block with an error that names `field` and `index`. If `index` is -1, the
// error must name no index.
void expect_kind_refusal(const OwnedBlock& block, Reason reason, const std::string& field, int index) {
  QueryBatch batch;
  batch.blocks = {block.view()};
  const absl::Status status = check_batch(batch);
  ASSERT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status << " for " << field;
  const Refusal refusal = refusal_of(status).value_or(Refusal{});
  EXPECT_EQ(reason_name(refusal.reason), reason_name(reason)) << status;
  EXPECT_EQ(refusal.field, "blocks[0]." + field);
  EXPECT_EQ(refusal.index ? static_cast<int>(*refusal.index) : -1, index) << status;
}

bool is_accepted(const OwnedBlock& block) {
  QueryBatch batch;
  batch.blocks = {block.view()};
  return check_batch(batch).ok();
}

OwnedBlock points(QueryBlock::Kind kind, size_t n = 4) {
  OwnedBlock block;
  block.settings.kind = std::move(kind);
  block.points.assign(3 * n, 1);
  return block;
}

OwnedBlock two_cubes() {
  OwnedBlock block;
  block.settings.kind = FrustumColumns{};
  for (int i = 0; i < 2; ++i)
    for (int axis = 0; axis < 3; ++axis)
      for (const float side : {-1.0f, 1.0f}) {
        float plane[4] = {0, 0, 0, 5};
        plane[axis] = side;
        block.points.insert(block.points.end(), plane, plane + 4);
      }
  return block;
}

OwnedBlock two_viewers_three_targets() {
  OwnedBlock block = points(SightColumns{}, 2);
  block.sizes.assign(9, 2);
  return block;
}

OwnedBlock pairs(PairColumns columns) {
  OwnedBlock block;
  block.settings.kind = columns;
  return block;
}

OwnedBlock four_cells() {
  OwnedBlock block = points(CellColumns{});
  block.extras = {10};
  return block;
}

TEST(CheckKindsTest, ValidBlocksAreAccepted) {
  for (const OwnedBlock& block : {two_cubes(), two_viewers_three_targets(), points(ContainsColumns{}), pairs({}),
                                  four_cells(), pairs({kInfinity, 0, 0, 3, 0})})
    EXPECT_TRUE(is_accepted(block)) << block.settings.kind.index();
}

TEST(CheckKindsTest, Frustums) {
  OwnedBlock block = two_cubes();
  block.points[24 + 3] = kNan;
  expect_kind_refusal(block, Reason::kNotFinite, "frustums.planes", 1);
  block = two_cubes();
  block.points.pop_back();
  expect_kind_refusal(block, Reason::kColumnLength, "frustums.planes", -1);
  for (const uint32_t each : {3u, 33u, std::numeric_limits<uint32_t>::max()}) {
    block = two_cubes();
    block.settings.kind = FrustumColumns{{}, {}, each};
    expect_kind_refusal(block, Reason::kLimit, "frustums.planes_each", -1);
  }
  block = two_cubes();
  block.extras.assign(16, 1);
  expect_kind_refusal(block, Reason::kMalformed, "frustums", -1);
  block = {};
  block.settings.kind = FrustumColumns{};
  block.extras.assign(32, 1);
  block.extras[20] = kInfinity;
  expect_kind_refusal(block, Reason::kNotFinite, "frustums.view_projections", 1);
  block.extras.assign(17, 1);
  expect_kind_refusal(block, Reason::kColumnLength, "frustums.view_projections", -1);
}

TEST(CheckKindsTest, Sight) {
  OwnedBlock block = two_viewers_three_targets();
  block.points[4] = kNan;
  expect_kind_refusal(block, Reason::kNotFinite, "sight.viewers", 1);
  block = two_viewers_three_targets();
  block.sizes[7] = 2e9f;
  expect_kind_refusal(block, Reason::kOutOfRange, "sight.targets", 2);
  block = two_viewers_three_targets();
  block.sizes.pop_back();
  expect_kind_refusal(block, Reason::kColumnLength, "sight.targets", -1);
  block = two_viewers_three_targets();
  block.groups = {1, 2, 3};
  expect_kind_refusal(block, Reason::kColumnLength, "sight.viewer_groups", -1);
  block = two_viewers_three_targets();
  block.target_groups = {1, 2};
  expect_kind_refusal(block, Reason::kColumnLength, "sight.target_groups", -1);
  block = two_viewers_three_targets();
  block.extras = {1, -1};
  expect_kind_refusal(block, Reason::kOutOfRange, "sight.max_distances", 1);
  block.extras = {kNan};
  expect_kind_refusal(block, Reason::kNotFinite, "sight.max_distances", 0);
  SightColumns columns;
  columns.samples = 256;
  block = two_viewers_three_targets();
  block.settings.kind = columns;
  expect_kind_refusal(block, Reason::kLimit, "sight.samples_per_target", -1);
  columns = {};
  columns.eyes = 17;
  block.settings.kind = columns;
  expect_kind_refusal(block, Reason::kLimit, "sight.eyes_per_viewer", -1);
  columns = {};
  columns.pairwise = true;
  block.settings.kind = columns;
  expect_kind_refusal(block, Reason::kColumnLength, "sight.targets", -1);
}

TEST(CheckKindsTest, TooManySegmentsAreRefusedBeforeTheyAreLookedAt) {
  OwnedBlock block = points(SightColumns{}, 4096);
  block.sizes.assign(3 * 1025, kNan);
  QueryBatch batch;
  batch.blocks = {block.view()};
  const absl::Status status = check_batch(batch);
  const Refusal refusal = refusal_of(status).value_or(Refusal{});
  EXPECT_EQ(refusal.limit, "sight_segments") << status;
  EXPECT_EQ(refusal.asked, 4096.0 * 1025);
}

TEST(CheckKindsTest, Contains) {
  OwnedBlock block = points(ContainsColumns{});
  block.points[10] = kNan;
  expect_kind_refusal(block, Reason::kNotFinite, "contains.points", 3);
}

TEST(CheckKindsTest, Pairs) {
  expect_kind_refusal(pairs({kNan}), Reason::kNotFinite, "pairs.max_distance", -1);
  expect_kind_refusal(pairs({-1}), Reason::kOutOfRange, "pairs.max_distance", -1);
  expect_kind_refusal(pairs({kInfinity}), Reason::kOutOfRange, "pairs.max_distance", -1);
  expect_kind_refusal(pairs({1, 0, 0, 1025}), Reason::kLimit, "pairs.k", -1);
  expect_kind_refusal(pairs({1, 0, 0, 0, 7}), Reason::kMalformed, "pairs.after_other", -1);
}

TEST(CheckKindsTest, Cells) {
  OwnedBlock block = four_cells();
  block.extras = {};
  expect_kind_refusal(block, Reason::kColumnLength, "cells.max_distances", -1);
  block.extras = {1, 1, 0, 1};
  expect_kind_refusal(block, Reason::kOutOfRange, "cells.max_distances", 2);
  block.extras = {kInfinity};
  expect_kind_refusal(block, Reason::kNotFinite, "cells.max_distances", 0);
  block = four_cells();
  block.settings.kind = CellColumns{{}, {}, 65};
  expect_kind_refusal(block, Reason::kLimit, "cells.max_planes", -1);
}

TEST(CheckKindsTest, ColumnsOfOtherKinds) {
  OwnedBlock block = points(ContainsColumns{});
  block.settings.columns = {Column::kT};
  expect_kind_refusal(block, Reason::kMalformed, "columns", -1);
  block = two_viewers_three_targets();
  block.settings.columns = {Column::kId};
  expect_kind_refusal(block, Reason::kMalformed, "columns", -1);
}

TEST(CheckKindsTest, Anchors) {
  OwnedBlock block = points(ContainsColumns{});
  block.anchor_ids = {1, 2};
  expect_kind_refusal(block, Reason::kColumnLength, "anchor_ids", -1);
  block.anchor_ids = {1, 2, 0, 4};
  expect_kind_refusal(block, Reason::kOutOfRange, "anchor_ids", 2);
  block = pairs({});
  block.anchor_ids = {1};
  expect_kind_refusal(block, Reason::kMalformed, "anchor_ids", -1);
}

TEST(CheckKindsTest, CountsNeedAKindWithCounts) {
  OwnedBlock rays = points(RayColumns{});
  rays.sizes = {1, 0, 0};
  for (OwnedBlock block : {rays, two_viewers_three_targets(), four_cells()}) {
    block.settings.count_only = true;
    expect_kind_refusal(block, Reason::kMalformed, "count_only", -1);
  }
}

TEST(CheckKindsTest, Pages) {
  OwnedBlock block = points(RayColumns{});
  block.sizes = {1, 0, 0};
  block.after_ts = {0, kNan, 0, 0};
  expect_kind_refusal(block, Reason::kNotFinite, "rays.after_ts", 1);
  block.after_ts = {0, 0};
  expect_kind_refusal(block, Reason::kColumnLength, "rays.after_ts", -1);
  block.after_ts = {};
  block.after_ids = {1};
  expect_kind_refusal(block, Reason::kMalformed, "rays.after_ids", -1);
  block.after_ts = {1};
  block.after_ids = {};
  block.after_triangles = {1};
  expect_kind_refusal(block, Reason::kMalformed, "rays.after_triangles", -1);
}

}  // namespace
}  // namespace locus::test
