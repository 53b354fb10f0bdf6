#include "core/query/query_batch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "core/base/refusal.h"
#include "tests/support/small_world.h"
#include "tests/support/special_floats.h"

namespace locus::test {
namespace {

// Returns two valid blocks, followed by `last`, the block that is tested.
std::vector<OwnedBlock> three_blocks(OwnedBlock last) {
  return {rays_along_x(RayMode::kFirst), one_ball({0, 0, 0}, 1), std::move(last)};
}

absl::Status status_with(const OwnedBlock& last) {
  const std::vector<OwnedBlock> blocks = three_blocks(last);
  return check_batch(batch_of(blocks));
}

OwnedBlock twenty_rays() {
  OwnedBlock block = rays_along_x(RayMode::kFirst, std::vector<float>(60, 1));
  block.sizes.assign(60, 1);
  block.extras.assign(20, 1);
  return block;
}

OwnedBlock twenty_balls() {
  OwnedBlock block = one_ball({}, 1);
  block.points.assign(60, 1);
  block.sizes.assign(20, 1);
  return block;
}

OwnedBlock twenty_points() {
  OwnedBlock block = one_point({}, 3);
  block.points.assign(60, 1);
  block.extras.assign(20, 1);
  return block;
}

OwnedBlock twenty_boxes() {
  OwnedBlock block = one_box({}, {1, 1, 1});
  block.points.assign(60, 1);
  block.sizes.assign(60, 1);
  for (int i = 0; i < 20; ++i) block.extras.insert(block.extras.end(), {0, 0, 0, 1});
  return block;
}

OwnedBlock twenty_capsules() {
  OwnedBlock block = twenty_boxes();
  block.settings.kind = CapsuleColumns();
  block.extras.assign(20, 1);
  return block;
}

OwnedBlock twenty_sweeps() {
  OwnedBlock block = twenty_capsules();
  block.settings.kind = SweepColumns();
  return block;
}

OwnedBlock twenty_box_sweeps() {
  OwnedBlock block = twenty_sweeps();
  block.extras.clear();
  block.half_extents.assign(60, 1);
  for (int i = 0; i < 20; ++i) block.rotations.insert(block.rotations.end(), {0, 0, 0, 1});
  return block;
}

Refusal refusal_for(const std::vector<OwnedBlock>& blocks) {
  const absl::Status status = check_batch(batch_of(blocks));
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
  return refusal_of(status).value_or(Refusal{});
}

// Expects that check_batch() refuses a batch whose block 2 is `block`, with an error that names `field` and `index`. If
// `index` is -1, the error must name no index.
void expect_refusal(const OwnedBlock& block, Reason reason, const std::string& field, int index) {
  const Refusal refusal = refusal_for(three_blocks(block));
  EXPECT_EQ(reason_name(refusal.reason), reason_name(reason));
  EXPECT_EQ(refusal.field, "blocks[2]." + field);
  EXPECT_EQ(refusal.index ? static_cast<int>(*refusal.index) : -1, index);
}

TEST(CheckBatchTest, ValidBlocksPass) {
  for (const OwnedBlock& block :
       {twenty_rays(), twenty_balls(), twenty_boxes(), twenty_capsules(), twenty_points(), twenty_sweeps(),
        twenty_box_sweeps(), lookup_of_ids({1}), lookup_of_groups({1}), rays_along_x(RayMode::kAny, {})})
    EXPECT_TRUE(status_with(block).ok());
}

TEST(CheckBatchTest, TheMessageNamesFieldAndIndex) {
  OwnedBlock block = twenty_rays();
  block.sizes[17 * 3 + 1] = kNan;
  const absl::Status status = status_with(block);
  EXPECT_NE(status.message().find("blocks[2].rays.directions[17]"), absl::string_view::npos) << status;
}

TEST(CheckBatchTest, RayValuesThatAreNotFiniteAreRefused) {
  for (const float wrong : {kNan, kInfinity, -kInfinity}) {
    OwnedBlock block = twenty_rays();
    block.points[19 * 3 + 2] = wrong;
    expect_refusal(block, Reason::kNotFinite, "rays.origins", 19);
    block = twenty_rays();
    block.sizes[17 * 3] = wrong;
    expect_refusal(block, Reason::kNotFinite, "rays.directions", 17);
  }
}

TEST(CheckBatchTest, DirectionsOfZeroAreRefused) {
  OwnedBlock block = twenty_rays();
  for (int axis = 0; axis < 3; ++axis) block.sizes[static_cast<size_t>(5 * 3 + axis)] = axis == 1 ? -0.0f : 0.0f;
  expect_refusal(block, Reason::kOutOfRange, "rays.directions", 5);
}

TEST(CheckBatchTest, DenormalDirectionsPass) {
  OwnedBlock block = twenty_rays();
  block.sizes.assign(60, std::numeric_limits<float>::denorm_min());
  EXPECT_TRUE(status_with(block).ok());
}

TEST(CheckBatchTest, TMaxMayBeInfiniteButNotNegativeOrNan) {
  OwnedBlock block = twenty_rays();
  block.extras[3] = kInfinity;
  block.extras[4] = 0;
  EXPECT_TRUE(status_with(block).ok());
  block.extras[7] = kNan;
  expect_refusal(block, Reason::kNotFinite, "rays.t_max", 7);
  block.extras[7] = -std::numeric_limits<float>::denorm_min();
  expect_refusal(block, Reason::kOutOfRange, "rays.t_max", 7);
  block.extras[7] = -kInfinity;
  expect_refusal(block, Reason::kOutOfRange, "rays.t_max", 7);
}

TEST(CheckBatchTest, RadiiMustBeFiniteAndNotNegative) {
  OwnedBlock block = twenty_balls();
  block.sizes[11] = kNan;
  expect_refusal(block, Reason::kNotFinite, "balls.radii", 11);
  block.sizes[11] = kInfinity;
  expect_refusal(block, Reason::kNotFinite, "balls.radii", 11);
  block.sizes[11] = -1;
  expect_refusal(block, Reason::kOutOfRange, "balls.radii", 11);
  block.sizes[11] = 1.001e9f;
  expect_refusal(block, Reason::kOutOfRange, "balls.radii", 11);
  block.sizes[11] = 1e9f;
  EXPECT_TRUE(status_with(block).ok());
}

TEST(CheckBatchTest, HalfExtentsMustBeFiniteAndNotNegative) {
  OwnedBlock block = twenty_boxes();
  block.sizes[3 * 8 + 2] = kNan;
  expect_refusal(block, Reason::kNotFinite, "boxes.half_extents", 8);
  block.sizes[3 * 8 + 2] = -1;
  expect_refusal(block, Reason::kOutOfRange, "boxes.half_extents", 8);
}

TEST(CheckBatchTest, CentersMustBeFinite) {
  OwnedBlock balls = twenty_balls();
  balls.points[4] = kNan;
  expect_refusal(balls, Reason::kNotFinite, "balls.centers", 1);
  OwnedBlock boxes = twenty_boxes();
  boxes.points[59] = kInfinity;
  expect_refusal(boxes, Reason::kNotFinite, "boxes.centers", 19);
}

TEST(CheckBatchTest, MaxDistancesMayBeInfiniteButNotNegativeOrNan) {
  OwnedBlock block = twenty_points();
  block.extras[11] = kInfinity;
  EXPECT_TRUE(status_with(block).ok());
  block.extras[11] = kNan;
  expect_refusal(block, Reason::kNotFinite, "nearest.max_distances", 11);
  for (const float wrong : {-kInfinity, -1.0f}) {
    block.extras[11] = wrong;
    expect_refusal(block, Reason::kOutOfRange, "nearest.max_distances", 11);
  }
}

TEST(CheckBatchTest, TheCountOfNearestHasALimit) {
  OwnedBlock block = twenty_points();
  std::get<NearestColumns>(block.settings.kind).count = limits::kMaxNearest;
  EXPECT_TRUE(status_with(block).ok());
  std::get<NearestColumns>(block.settings.kind).count = limits::kMaxNearest + 1;
  expect_refusal(block, Reason::kLimit, "nearest.k", -1);
}

TEST(CheckBatchTest, PointsMustBeFiniteAndInTheWorld) {
  OwnedBlock block = twenty_points();
  block.points[4] = kNan;
  expect_refusal(block, Reason::kNotFinite, "nearest.points", 1);
  block.points[4] = 1.1e9f;
  expect_refusal(block, Reason::kOutOfRange, "nearest.points", 1);
}

TEST(CheckBatchTest, RotationsMustBeOfUnitLengthWithinAThousandth) {
  OwnedBlock block = twenty_boxes();
  float& w = block.extras[4 * 6 + 3];
  w = 1.0009f;
  EXPECT_TRUE(status_with(block).ok());
  for (const float wrong : {1.0011f, 0.9989f, 0.0f, -0.5f}) {
    w = wrong;
    expect_refusal(block, Reason::kOutOfRange, "boxes.rotations", 6);
  }
  w = kNan;
  expect_refusal(block, Reason::kNotFinite, "boxes.rotations", 6);
  w = kInfinity;
  expect_refusal(block, Reason::kNotFinite, "boxes.rotations", 6);
}

TEST(CheckBatchTest, FramesMustBeFiniteAndInTheWorld) {
  OwnedBlock block = twenty_rays();
  block.settings.frame = {0, 0, std::numeric_limits<double>::quiet_NaN()};
  expect_refusal(block, Reason::kNotFinite, "frame", -1);
  block.settings.frame = {0, -1.0000001e9, 0};
  expect_refusal(block, Reason::kOutOfRange, "frame", -1);
}

TEST(CheckBatchTest, FrameAndOffsetTogetherMustBeInTheWorld) {
  OwnedBlock block = twenty_rays();
  block.settings.frame = {1e9, 0, 0};
  expect_refusal(block, Reason::kOutOfRange, "rays.origins", 0);
  block.points.assign(60, -1);
  EXPECT_TRUE(status_with(block).ok());
  block.points[3 * 12] = 0.5f;
  expect_refusal(block, Reason::kOutOfRange, "rays.origins", 12);
}

struct Column20 {
  const char* field;
  OwnedBlock (*block)();
  std::function<std::vector<float>&(OwnedBlock&)> column;
  size_t width;
  bool one_for_all, none;
};

TEST(CheckBatchTest, CapsulesLieWithinTheWorldAndHaveRadii) {
  OwnedBlock block = twenty_capsules();
  block.points[59] = kInfinity;
  expect_refusal(block, Reason::kNotFinite, "capsules.starts", 19);
  block = twenty_capsules();
  block.sizes[3 * 4] = kNan;
  expect_refusal(block, Reason::kNotFinite, "capsules.ends", 4);
  block.sizes[3 * 4] = 2e9f;
  expect_refusal(block, Reason::kOutOfRange, "capsules.ends", 4);
  block = twenty_capsules();
  block.extras[7] = -1;
  expect_refusal(block, Reason::kOutOfRange, "capsules.radii", 7);
  block.extras[7] = kNan;
  expect_refusal(block, Reason::kNotFinite, "capsules.radii", 7);
}

TEST(CheckBatchTest, SweepsAreBallsCapsulesOrBoxes) {
  OwnedBlock block = twenty_sweeps();
  block.points[59] = kInfinity;
  expect_refusal(block, Reason::kNotFinite, "sweeps.starts", 19);
  block = twenty_sweeps();
  block.sizes[3 * 4] = 2e9f;
  expect_refusal(block, Reason::kOutOfRange, "sweeps.ends", 4);
  block = twenty_sweeps();
  block.extras[7] = 0;
  expect_refusal(block, Reason::kOutOfRange, "sweeps.radii", 7);
  block.extras[7] = kNan;
  expect_refusal(block, Reason::kNotFinite, "sweeps.radii", 7);
  block = twenty_sweeps();
  block.half_axes.assign(60, 1);
  EXPECT_TRUE(status_with(block).ok());
  block.half_axes[5] = kNan;
  expect_refusal(block, Reason::kNotFinite, "sweeps.half_axes", 1);
  block.half_axes[5] = -2e9f;
  expect_refusal(block, Reason::kOutOfRange, "sweeps.half_axes", 1);
  block = twenty_sweeps();
  block.rotations.assign(4, 0.5f);
  expect_refusal(block, Reason::kMalformed, "sweeps.rotations", -1);
  block = twenty_box_sweeps();
  block.half_extents[9] = block.half_extents[10] = 0;
  EXPECT_TRUE(status_with(block).ok());
  block.half_extents[11] = 0;
  expect_refusal(block, Reason::kOutOfRange, "sweeps.half_extents", 3);
  block = twenty_box_sweeps();
  block.rotations[7] = 3;
  expect_refusal(block, Reason::kOutOfRange, "sweeps.rotations", 1);
  block = twenty_box_sweeps();
  block.extras = {1};
  expect_refusal(block, Reason::kMalformed, "sweeps.radii", -1);
  block = twenty_box_sweeps();
  block.half_axes = {1, 1, 1};
  expect_refusal(block, Reason::kMalformed, "sweeps.half_axes", -1);
}

TEST(CheckBatchTest, ColumnsHaveNEntriesOrOneOrIfOptionalNone) {
  const auto sizes = [](OwnedBlock& b) -> std::vector<float>& { return b.sizes; };
  const auto extras = [](OwnedBlock& b) -> std::vector<float>& { return b.extras; };
  const Column20 columns[] = {{"rays.directions", twenty_rays, sizes, 3, true, false},
                              {"rays.t_max", twenty_rays, extras, 1, true, true},
                              {"balls.radii", twenty_balls, sizes, 1, true, false},
                              {"boxes.half_extents", twenty_boxes, sizes, 3, true, false},
                              {"boxes.rotations", twenty_boxes, extras, 4, true, true},
                              {"capsules.ends", twenty_capsules, sizes, 3, true, false},
                              {"capsules.radii", twenty_capsules, extras, 1, true, false},
                              {"nearest.max_distances", twenty_points, extras, 1, true, true}};
  for (const Column20& c : columns) {
    OwnedBlock block = c.block();
    const std::vector<float> whole = c.column(block);
    for (const size_t numbers : {size_t{0}, size_t{1}, c.width, 2 * c.width, whole.size() - 1, whole.size()}) {
      c.column(block).assign(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(numbers));
      if (c.width == 4 && numbers == 4) c.column(block) = {0, 0, 0, 1};
      const bool fits = numbers == whole.size() || (c.one_for_all && numbers == c.width) || (c.none && numbers == 0);
      if (fits) {
        EXPECT_TRUE(status_with(block).ok()) << c.field << " " << numbers;
      } else {
        expect_refusal(block, Reason::kColumnLength, c.field, -1);
      }
    }
  }
  OwnedBlock rays = twenty_rays();
  rays.points.pop_back();
  expect_refusal(rays, Reason::kColumnLength, "rays.origins", -1);
  OwnedBlock balls = twenty_balls();
  balls.points.push_back(0);
  expect_refusal(balls, Reason::kColumnLength, "balls.centers", -1);
}

TEST(CheckBatchTest, MasksAndIgnoredGroupsHaveNEntriesOrOneOrNone) {
  OwnedBlock block = twenty_rays();
  for (const size_t entries : {0u, 1u, 20u}) {
    block.masks.assign(entries, 1);
    block.ignore_groups.assign(entries, 1);
    EXPECT_TRUE(status_with(block).ok());
  }
  block.masks.assign(19, 1);
  expect_refusal(block, Reason::kColumnLength, "masks", -1);
  block.masks.clear();
  block.ignore_groups.assign(21, 1);
  expect_refusal(block, Reason::kColumnLength, "ignore_groups", -1);
}

TEST(CheckBatchTest, TagsAndSelfIdsHaveNEntriesOrOneOrNone) {
  OwnedBlock block = twenty_rays();
  for (const size_t entries : {0u, 1u, 20u}) {
    block.tags.assign(entries, 1);
    block.tag_masks.assign(entries, 1);
    block.self_ids.assign(entries, 0);
    EXPECT_TRUE(status_with(block).ok());
  }
  block.tags.assign(19, 1);
  expect_refusal(block, Reason::kColumnLength, "tags", -1);
  block.tags.assign(1, 1);
  block.tag_masks.assign(2, 1);
  expect_refusal(block, Reason::kColumnLength, "tag_masks", -1);
  block.tags.clear();
  block.tag_masks.assign(1, 1);
  expect_refusal(block, Reason::kMalformed, "tag_masks", -1);
  block.tag_masks.clear();
  block.self_ids.assign(21, 1);
  expect_refusal(block, Reason::kColumnLength, "self_ids", -1);
}

TEST(CheckBatchTest, OnlyGroupsHaveUpTo16GroupsForEachQueryOrForAll) {
  OwnedBlock block = twenty_rays();
  for (const uint32_t each : {0u, 1u, 3u, 16u}) {
    block.settings.only_groups_each = each;
    for (const size_t entries : {0u, 1u, 20u}) {
      block.only_groups.assign(entries * std::max(each, 1u), 1);
      EXPECT_TRUE(status_with(block).ok()) << each << " " << entries;
    }
    block.only_groups.push_back(1);
    expect_refusal(block, Reason::kColumnLength, "only_groups", -1);
  }
  block.settings.only_groups_each = 17;
  block.only_groups.assign(17, 1);
  expect_refusal(block, Reason::kLimit, "only_groups_each", -1);
}

TEST(CheckBatchTest, AtMost64IdsAreIgnored) {
  OwnedBlock block = twenty_rays();
  block.ignore_ids.assign(64, 7);
  EXPECT_TRUE(status_with(block).ok());
  block.ignore_ids.push_back(7);
  expect_refusal(block, Reason::kLimit, "ignore_ids", -1);
}

TEST(CheckBatchTest, MaxResultsHasALimit) {
  OwnedBlock block = twenty_rays();
  block.settings.max_results = limits::kMaxMaxResults;
  EXPECT_TRUE(status_with(block).ok());
  ++block.settings.max_results;
  expect_refusal(block, Reason::kLimit, "max_results", -1);
}

TEST(CheckBatchTest, ABatchHasAtMost256Blocks) {
  std::vector<OwnedBlock> blocks(256, rays_along_x(RayMode::kFirst));
  EXPECT_TRUE(check_batch(batch_of(blocks)).ok());
  blocks.push_back(rays_along_x(RayMode::kFirst));
  const Refusal refusal = refusal_for(blocks);
  EXPECT_EQ(refusal.field, "blocks");
  EXPECT_EQ(refusal.limit, "blocks");
  EXPECT_EQ(refusal.limit_value, 256);
  EXPECT_EQ(refusal.asked, 257);
}

TEST(CheckBatchTest, ABatchHasAtMost65536QueriesOtherThanRaysOverAllBlocks) {
  std::vector<OwnedBlock> blocks(2, lookup_of_ids(std::vector<uint64_t>(32768, 1)));
  for (OwnedBlock& block : blocks) block.settings.columns = {Column::kId};
  EXPECT_TRUE(check_batch(batch_of(blocks)).ok());
  blocks.push_back(rays_along_x(RayMode::kAny, {0, 0, 0}));
  EXPECT_TRUE(check_batch(batch_of(blocks)).ok());
  blocks.push_back(lookup_of_ids({1}));
  const Refusal refusal = refusal_for(blocks);
  EXPECT_EQ(refusal.reason, Reason::kLimit);
  EXPECT_EQ(refusal.limit, "queries");
  EXPECT_EQ(refusal.asked, 65537);
}

TEST(CheckBatchTest, ABatchHasAtMost262144RaysOverAllBlocksAndTheirDistancesFitADefaultReply) {
  std::vector<OwnedBlock> blocks(2, rays_along_x(RayMode::kFirst, std::vector<float>(3 * 131'072, 0)));
  for (OwnedBlock& block : blocks) block.settings.columns = {Column::kT};
  EXPECT_TRUE(check_batch(batch_of(blocks)).ok());
  blocks[0].settings.columns = blocks[1].settings.columns = {};
  EXPECT_EQ(refusal_for(blocks).limit, "max_reply_bytes");
  blocks.push_back(rays_along_x(RayMode::kAny, {0, 0, 0}));
  const Refusal refusal = refusal_for(blocks);
  EXPECT_EQ(refusal.reason, Reason::kLimit);
  EXPECT_EQ(refusal.limit, "rays");
  EXPECT_EQ(refusal.asked, 262'145);
}

TEST(CheckBatchTest, OneOriginServesAllDirections) {
  OwnedBlock block = twenty_rays();
  block.points.resize(3);
  block.extras.assign(20, 1);
  EXPECT_EQ(query_count(block.view()), 20u);
  EXPECT_TRUE(status_with(block).ok());
  block.extras.assign(19, 1);
  expect_refusal(block, Reason::kColumnLength, "rays.t_max", -1);
  block.extras.clear();
  block.points = {0, 0, 0, 1, 1, 1};
  expect_refusal(block, Reason::kColumnLength, "rays.directions", -1);
  block.points.clear();
  expect_refusal(block, Reason::kColumnLength, "rays.directions", -1);
  block.points = {0, 0, std::numeric_limits<float>::infinity()};
  expect_refusal(block, Reason::kNotFinite, "rays.origins", 0);
}

TEST(CheckBatchTest, ARotationIsOneUnitQuaternionAndForRaysOnly) {
  OwnedBlock block = twenty_rays();
  block.rotation = {0, 0.6f, 0, 0.8f};
  EXPECT_TRUE(status_with(block).ok());
  block.rotation.pop_back();
  expect_refusal(block, Reason::kColumnLength, "rotation", -1);
  block.rotation.assign(8, 0.5f);
  expect_refusal(block, Reason::kColumnLength, "rotation", -1);
  block.rotation = {0, 0, 0, 1.01f};
  expect_refusal(block, Reason::kOutOfRange, "rotation", 0);
  block.rotation = {0, 0, std::numeric_limits<float>::quiet_NaN(), 1};
  expect_refusal(block, Reason::kNotFinite, "rotation", 0);
  block = twenty_balls();
  block.rotation = {0, 0, 0, 1};
  expect_refusal(block, Reason::kMalformed, "rotation", -1);
}

TEST(CheckBatchTest, MaxReplyBytesHasALimit) {
  const std::vector<OwnedBlock> blocks = {rays_along_x(RayMode::kFirst)};
  QueryBatch batch = batch_of(blocks);
  batch.max_reply_bytes = limits::kMaxReplyBytes;
  EXPECT_TRUE(check_batch(batch).ok());
  ++batch.max_reply_bytes;
  EXPECT_EQ(refusal_of(check_batch(batch)).value_or(Refusal{}).field, "max_reply_bytes");
}

TEST(CheckBatchTest, DenseRowsMustFitTheReply) {
  std::vector<OwnedBlock> blocks = {rays_along_x(RayMode::kFirst, std::vector<float>(3 * 65536, 0))};
  EXPECT_TRUE(check_batch(batch_of(blocks)).ok());  // the columns T, ID and TRIANGLE have 16 bytes per ray
  blocks[0].settings.columns = {Column::kT, Column::kId, Column::kNormal, Column::kPoint, Column::kPose};
  const Refusal refusal = refusal_for(blocks);
  EXPECT_EQ(refusal.reason, Reason::kLimit);
  EXPECT_EQ(refusal.field, "max_reply_bytes");
  EXPECT_EQ(refusal.limit_value, limits::kDefaultReplyBytes);
  EXPECT_GT(refusal.asked, 65536.0 * 76);
  QueryBatch batch = batch_of(blocks);
  batch.max_reply_bytes = 8'000'000;
  EXPECT_TRUE(check_batch(batch).ok());
}

TEST(CheckBatchTest, TheIndexOfAWrongValueIsItsQueryInEveryColumnAndAWrongLengthHasNone) {
  OwnedBlock rays = twenty_rays();
  rays.sizes[3 * 7 + 2] = std::numeric_limits<float>::infinity();
  Refusal refusal = refusal_for({rays});
  EXPECT_EQ(refusal.field, "blocks[0].rays.directions");
  EXPECT_EQ(refusal.index, std::optional<uint32_t>(7));
  rays.sizes = {0, 0, 0};
  refusal = refusal_for({rays});
  EXPECT_EQ(refusal.field, "blocks[0].rays.directions");
  EXPECT_EQ(refusal.index, std::optional<uint32_t>(0)) << "one direction for all";
  rays.sizes.assign(57, 1);
  refusal = refusal_for({rays});
  EXPECT_EQ(refusal.reason, Reason::kColumnLength);
  EXPECT_EQ(refusal.index, std::nullopt);
}

TEST(CheckBatchTest, CountsCannotBeCutEither) {
  OwnedBlock balls = one_ball({}, 1);
  balls.points.assign(3 * 1000, 1);
  const std::vector<OwnedBlock> blocks = {balls};
  QueryBatch batch = batch_of(blocks);
  batch.max_reply_bytes = 1000 * (4 + 4) + 2 * 256;  // counts, list of truncated queries, overhead of block and reply
  EXPECT_TRUE(check_batch(batch).ok());
  --batch.max_reply_bytes;
  const Refusal refusal = refusal_of(check_batch(batch)).value_or(Refusal{});
  EXPECT_EQ(refusal.reason, Reason::kLimit);
  EXPECT_EQ(refusal.field, "max_reply_bytes");
  EXPECT_EQ(refusal.limit_value, 8511);
  EXPECT_EQ(refusal.asked, 8512);
}

TEST(CheckBatchTest, RaysOfModeAnyHaveNoColumns) {
  OwnedBlock block = rays_along_x(RayMode::kAny);
  block.settings.columns = {Column::kT};
  expect_refusal(block, Reason::kMalformed, "columns", -1);
}

TEST(CheckBatchTest, ColumnsThatAKindDoesNotServeAreRefused) {
  for (const Column column : {Column::kT, Column::kUv, Column::kNormal, Column::kPoint}) {
    OwnedBlock block = lookup_of_ids({1});
    block.settings.columns = {Column::kId, column};
    expect_refusal(block, Reason::kMalformed, "columns", -1);
  }
  for (OwnedBlock block : {twenty_balls(), twenty_capsules(), twenty_points()}) {
    block.settings.columns = {Column::kId, Column::kOther};
    expect_refusal(block, Reason::kMalformed, "columns", -1);
  }
  for (OwnedBlock block : {twenty_balls(), twenty_boxes(), twenty_capsules()}) {
    block.settings.columns = {Column::kUv};
    expect_refusal(block, Reason::kMalformed, "columns", -1);
  }
  OwnedBlock lookup = lookup_of_groups({1});
  lookup.settings.columns = {Column::kTriangle};
  expect_refusal(lookup, Reason::kMalformed, "columns", -1);
}

TEST(CheckBatchTest, LookupsHaveEitherIdsOrGroups) {
  OwnedBlock both = lookup_of_ids({1});
  both.groups = {1};
  expect_refusal(both, Reason::kMalformed, "lookup", -1);
  expect_refusal(lookup_of_ids({}), Reason::kMalformed, "lookup", -1);
}

TEST(CheckBatchTest, ZeroIsRefusedAsIdAndAsGroup) {
  expect_refusal(lookup_of_ids({3, 4, 0}), Reason::kOutOfRange, "lookup.ids", 2);
  expect_refusal(lookup_of_groups({3, 0}), Reason::kOutOfRange, "lookup.groups", 1);
}

TEST(QueryBatchTest, TimesOfThePastAreChecked) {
  OwnedBlock block = twenty_balls();
  block.as_of_ticks.assign(20, 5);
  block.as_of_fractions.assign(20, 0.5f);
  EXPECT_TRUE(status_with(block).ok());
  block.as_of_fractions[7] = 1;
  expect_refusal(block, Reason::kOutOfRange, "as_of_fractions", 7);
  block.as_of_fractions[7] = -1e-6f;
  expect_refusal(block, Reason::kOutOfRange, "as_of_fractions", 7);
  block.as_of_fractions[7] = kNan;
  expect_refusal(block, Reason::kNotFinite, "as_of_fractions", 7);
  block.as_of_fractions.resize(2);
  expect_refusal(block, Reason::kColumnLength, "as_of_fractions", -1);
  block.as_of_fractions.clear();
  block.as_of_ticks.resize(3);
  expect_refusal(block, Reason::kColumnLength, "as_of_ticks", -1);
  block.as_of_ticks.clear();
  block.as_of_fractions = {0.5f};
  expect_refusal(block, Reason::kMalformed, "as_of_fractions", -1);
}

}  // namespace
}  // namespace locus::test
