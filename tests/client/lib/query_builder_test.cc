#include "client/lib/query_builder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace locus::client {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

TEST(QueryBuilderTest, RaysAddedByRowFillOnlyColumnsWhoseRowsDiffer) {
  QueryBuilder builder;
  builder.rays()
      .mode(v1::RAY_MODE_ALL)
      .cull(v1::CULL_BACK)
      .inside(v1::INSIDE_SKIP)
      .ray({0, 1, 0}, {0, 0, -1})
      .ray({1, 1, 0}, {0, 0, -2}, 50, {.mask = 6, .ignore_group = 3})
      .ray({2, 1, 0}, {0, 0, -3});
  const v1::QueryBlock block = builder.build().blocks(0);
  EXPECT_THAT(block.rays().origins(), ElementsAre(0, 1, 0, 1, 1, 0, 2, 1, 0));
  EXPECT_THAT(block.rays().directions(), ElementsAre(0, 0, -1, 0, 0, -2, 0, 0, -3));
  EXPECT_THAT(block.rays().t_max(), ElementsAre(kInfinity, 50, kInfinity));
  EXPECT_THAT(block.masks(), ElementsAre(kEveryMask, 6, kEveryMask));
  EXPECT_THAT(block.ignore_groups(), ElementsAre(0, 3, 0));
  EXPECT_EQ(block.rays().mode(), v1::RAY_MODE_ALL);
  EXPECT_EQ(block.rays().cull(), v1::CULL_BACK);
  EXPECT_EQ(block.rays().inside(), v1::INSIDE_SKIP);
}

TEST(QueryBuilderTest, FiltersOfARowFillTheirColumns) {
  QueryBuilder builder;
  builder.rays()
      .ray({0, 1, 0}, {0, 0, -1})
      .ray({1, 1, 0}, {0, 0, -2}, 50, {.only_group = 4, .self_id = 7, .tag = 0, .tag_mask = 0xFF})
      .ray({2, 1, 0}, {0, 0, -3}, 50, {.tag = 5, .tag_mask = 6})
      .ray({3, 1, 0}, {0, 0, -3}, 50, {.tag = 7});
  const v1::QueryBlock block = builder.build().blocks(0);
  EXPECT_THAT(block.only_groups(), ElementsAre(0, 4, 0, 0));
  EXPECT_THAT(block.self_ids(), ElementsAre(0, 7, 0, 0));
  EXPECT_THAT(block.tags(), ElementsAre(0, 0, 5, 7));
  EXPECT_THAT(block.tag_masks(), ElementsAre(0, 0xFF, 6, ~uint64_t{0})) << "a tag without a mask compares all bits";
}

TEST(QueryBuilderTest, FiltersOfABlockAreWholeColumns) {
  QueryBuilder builder;
  builder.balls().balls({{0, 0, 0}}, {{1}}).only_groups({{3, 4}}, 2).tags({{5}}, {{6}}).self_ids({{7}});
  const v1::QueryBlock block = builder.build().blocks(0);
  EXPECT_THAT(block.only_groups(), ElementsAre(3, 4));
  EXPECT_EQ(block.only_groups_each(), 2u);
  EXPECT_THAT(block.tags(), ElementsAre(5));
  EXPECT_THAT(block.tag_masks(), ElementsAre(6));
  EXPECT_THAT(block.self_ids(), ElementsAre(7));
}

TEST(QueryBuilderTest, OneOriginAndARotationServeAllDirections) {
  QueryBuilder builder;
  builder.rays().rays({{1, 2, 3}}, {{1, 0, 0, 0, 1, 0}}).rotation({0, 0.6f, 0, 0.8f});
  const v1::QueryBlock block = builder.build().blocks(0);
  EXPECT_THAT(block.rays().origins(), ElementsAre(1, 2, 3));
  EXPECT_THAT(block.rays().directions(), ElementsAre(1, 0, 0, 0, 1, 0));
  EXPECT_THAT(block.rotation(), ElementsAre(0, 0.6f, 0, 0.8f));
}

TEST(QueryBuilderTest, DefaultValuesLeaveColumnsEmpty) {
  QueryBuilder builder;
  builder.rays().ray({0, 1, 0}, {0, 0, -1});
  const v1::QueryBlock block = builder.build().blocks(0);
  EXPECT_THAT(block.rays().t_max(), IsEmpty());
  EXPECT_THAT(block.masks(), IsEmpty());
  EXPECT_THAT(block.ignore_groups(), IsEmpty());
  EXPECT_THAT(block.only_groups(), IsEmpty());
  EXPECT_THAT(block.tags(), IsEmpty());
  EXPECT_THAT(block.tag_masks(), IsEmpty());
  EXPECT_THAT(block.self_ids(), IsEmpty());
}

TEST(QueryBuilderTest, AsOfTimesAreColumns) {
  QueryBuilder builder;
  builder.lookup().id(7).as_of({{12}}, {{0.5f}}).outside_history(v1::OUTSIDE_HISTORY_CLAMP);
  const v1::QueryBlock block = builder.build().blocks(0);
  EXPECT_THAT(block.as_of_ticks(), ElementsAre(12));
  EXPECT_THAT(block.as_of_fractions(), ElementsAre(0.5f));
  EXPECT_EQ(block.outside_history(), v1::OUTSIDE_HISTORY_CLAMP);
}

TEST(QueryBuilderTest, WholeSpansAppend) {
  const std::vector<float> origins = {0, 0, 0, 1, 1, 1};
  const std::vector<float> directions = {0, 0, 1};
  const std::vector<float> t_max = {9};
  const std::vector<uint32_t> masks = {1, 2};
  const std::vector<uint64_t> ignored = {5, 6};
  QueryBuilder builder;
  builder.rays().rays(origins, directions).t_max(t_max).masks(masks).ignore_ids(ignored).ignore_groups({{7}});
  const v1::QueryBlock block = builder.build().blocks(0);
  EXPECT_THAT(block.rays().origins(), ElementsAre(0, 0, 0, 1, 1, 1));
  EXPECT_THAT(block.rays().directions(), ElementsAre(0, 0, 1));
  EXPECT_THAT(block.rays().t_max(), ElementsAre(9));
  EXPECT_THAT(block.masks(), ElementsAre(1, 2));
  EXPECT_THAT(block.ignore_ids(), ElementsAre(5, 6));
  EXPECT_THAT(block.ignore_groups(), ElementsAre(7));
}

TEST(QueryBuilderTest, CapsulesAreAppendedOneByOneAndInColumns) {
  QueryBuilder builder;
  builder.capsules()
      .detail(v1::STATIC_DETAIL_TRIANGLES)
      .capsule({1, 2, 3}, {4, 5, 6}, 7)
      .capsule({0, 0, 0}, {0, 0, 1}, 2);
  const std::vector<float> starts = {1, 1, 1, 2, 2, 2}, ends = {3, 3, 3}, radii = {0.5f};
  builder.capsules().capsules(starts, ends, radii);
  const v1::QueryBatch batch = builder.build();
  EXPECT_EQ(batch.blocks(0).capsules().detail(), v1::STATIC_DETAIL_TRIANGLES);
  EXPECT_THAT(batch.blocks(0).capsules().starts(), ElementsAre(1, 2, 3, 0, 0, 0));
  EXPECT_THAT(batch.blocks(0).capsules().ends(), ElementsAre(4, 5, 6, 0, 0, 1));
  EXPECT_THAT(batch.blocks(0).capsules().radii(), ElementsAre(7, 2));
  EXPECT_THAT(batch.blocks(1).capsules().starts(), ElementsAre(1, 1, 1, 2, 2, 2));
  EXPECT_THAT(batch.blocks(1).capsules().ends(), ElementsAre(3, 3, 3));
  EXPECT_THAT(batch.blocks(1).capsules().radii(), ElementsAre(0.5f));
}

TEST(QueryBuilderTest, SweepsAreAppendedOneByOneAndInColumns) {
  QueryBuilder builder;
  builder.sweeps()
      .mode(v1::RAY_MODE_ALL)
      .at_start(v1::AT_START_APPROACH)
      .capsule({1, 2, 3}, {4, 5, 6}, {0, 0, 2}, 7)
      .capsule({0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 2, {.mask = 4});
  builder.sweeps().box({1, 1, 1}, {2, 2, 2}, {1, 2, 3}).box({1, 1, 1}, {2, 2, 2}, {1, 2, 3}, {0, 0, 1, 0});
  const std::vector<float> starts = {1, 1, 1, 2, 2, 2}, ends = {3, 3, 3}, radii = {0.5f};
  builder.sweeps().sweeps(starts, ends).radii(radii);
  const v1::QueryBatch batch = builder.build();
  const v1::Sweeps& capsules = batch.blocks(0).sweeps();
  EXPECT_EQ(capsules.mode(), v1::RAY_MODE_ALL);
  EXPECT_EQ(capsules.at_start(), v1::AT_START_APPROACH);
  EXPECT_THAT(capsules.starts(), ElementsAre(1, 2, 3, 0, 0, 0));
  EXPECT_THAT(capsules.ends(), ElementsAre(4, 5, 6, 0, 0, 1));
  EXPECT_THAT(capsules.half_axes(), ElementsAre(0, 0, 2, 0, 1, 0));
  EXPECT_THAT(capsules.radii(), ElementsAre(7, 2));
  EXPECT_THAT(batch.blocks(0).masks(), ElementsAre(0xFFFFFFFFu, 4u));
  const v1::Sweeps& boxes = batch.blocks(1).sweeps();
  EXPECT_THAT(boxes.half_extents(), ElementsAre(1, 2, 3, 1, 2, 3));
  EXPECT_THAT(boxes.rotations(), ElementsAre(0, 0, 0, 1, 0, 0, 1, 0));
  EXPECT_EQ(boxes.radii_size(), 0);
  const v1::Sweeps& balls = batch.blocks(2).sweeps();
  EXPECT_THAT(balls.starts(), ElementsAre(1, 1, 1, 2, 2, 2));
  EXPECT_THAT(balls.ends(), ElementsAre(3, 3, 3));
  EXPECT_THAT(balls.radii(), ElementsAre(0.5f));
}

TEST(QueryBuilderTest, BlocksKeepTheirOrderAndTheirOwnSettings) {
  QueryBuilder builder;
  BallBlock balls = builder.balls();
  BoxBlock boxes = builder.boxes();
  builder.lookup().id(7).ids({{8, 9}});
  builder.lookup().group(3);
  balls.frame({1e6, 0, 0}).source(v1::SOURCE_DYNAMIC).precision(v1::PRECISION_CONSERVATIVE).max_results(5).after_id(2);
  balls.detail(v1::STATIC_DETAIL_TRIANGLES).ball({1, 2, 3}, 4).ball({5, 6, 7}, 8, {.mask = 1});
  boxes.columns({v1::COLUMN_ID, v1::COLUMN_TAG}).box({1, 2, 3}, {4, 5, 6}).box({0, 0, 0}, {1, 1, 1}, {0, 0, 1, 0});
  const v1::QueryBatch batch = builder.build();
  ASSERT_EQ(batch.blocks_size(), 4);
  EXPECT_EQ(batch.blocks(0).frame().x(), 1e6);
  EXPECT_EQ(batch.blocks(0).source(), v1::SOURCE_DYNAMIC);
  EXPECT_EQ(batch.blocks(0).precision(), v1::PRECISION_CONSERVATIVE);
  EXPECT_EQ(batch.blocks(0).max_results(), 5u);
  EXPECT_EQ(batch.blocks(0).after_id(), 2u);
  EXPECT_EQ(batch.blocks(0).balls().detail(), v1::STATIC_DETAIL_TRIANGLES);
  EXPECT_THAT(batch.blocks(0).balls().centers(), ElementsAre(1, 2, 3, 5, 6, 7));
  EXPECT_THAT(batch.blocks(0).balls().radii(), ElementsAre(4, 8));
  EXPECT_THAT(batch.blocks(0).masks(), ElementsAre(kEveryMask, 1));
  EXPECT_THAT(batch.blocks(1).columns(), ElementsAre(v1::COLUMN_ID, v1::COLUMN_TAG));
  EXPECT_THAT(batch.blocks(1).boxes().half_extents(), ElementsAre(4, 5, 6, 1, 1, 1));
  EXPECT_THAT(batch.blocks(1).boxes().rotations(), ElementsAre(0, 0, 0, 1, 0, 0, 1, 0));
  EXPECT_THAT(batch.blocks(2).lookup().ids(), ElementsAre(7, 8, 9));
  EXPECT_THAT(batch.blocks(3).lookup().groups(), ElementsAre(3));
}

TEST(QueryBuilderTest, PointsAreAddedByRowOrAsAColumn) {
  QueryBuilder builder;
  builder.nearest().k(4).detail(v1::STATIC_DETAIL_TRIANGLES).point({1, 2, 3}).point({4, 5, 6}, 7, {.ignore_group = 9});
  builder.nearest().points({1, 2, 3, 4, 5, 6}).max_distances({8});
  const v1::QueryBatch batch = builder.build();
  EXPECT_EQ(batch.blocks(0).nearest().k(), 4u);
  EXPECT_EQ(batch.blocks(0).nearest().detail(), v1::STATIC_DETAIL_TRIANGLES);
  EXPECT_THAT(batch.blocks(0).nearest().points(), ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(batch.blocks(0).nearest().max_distances(), ElementsAre(kInfinity, 7));
  EXPECT_THAT(batch.blocks(0).ignore_groups(), ElementsAre(0, 9));
  EXPECT_THAT(batch.blocks(1).nearest().points(), ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(batch.blocks(1).nearest().max_distances(), ElementsAre(8));
}

TEST(QueryBuilderTest, AnchorsCountsAndPagesAreSettingsOfABlock) {
  QueryBuilder builder;
  builder.rays().ray({0, 0, 0}, {1, 0, 0}).anchors({{7}}).after({{2.5f}}, {{8}}, {{9}});
  builder.nearest().point({0, 0, 0}).after({{3}}).count_only();
  const v1::QueryBatch batch = builder.build();
  EXPECT_THAT(batch.blocks(0).anchor_ids(), ElementsAre(7));
  EXPECT_FALSE(batch.blocks(0).count_only());
  EXPECT_THAT(batch.blocks(0).rays().after_ts(), ElementsAre(2.5f));
  EXPECT_THAT(batch.blocks(0).rays().after_ids(), ElementsAre(8));
  EXPECT_THAT(batch.blocks(0).rays().after_triangles(), ElementsAre(9));
  EXPECT_TRUE(batch.blocks(1).count_only());
  EXPECT_THAT(batch.blocks(1).nearest().after_ts(), ElementsAre(3));
}

TEST(QueryBuilderTest, RegionsArePlanesOrMatrices) {
  QueryBuilder builder;
  const std::vector<float> planes(16, 1), matrix(16, 2);
  builder.frustums().planes(planes, 4).detail(v1::STATIC_DETAIL_TRIANGLES);
  builder.frustums().view_projections(matrix, v1::CLIP_DEPTH_MINUS_ONE_TO_ONE);
  const v1::QueryBatch batch = builder.build();
  EXPECT_EQ(batch.blocks(0).frustums().planes_size(), 16);
  EXPECT_EQ(batch.blocks(0).frustums().planes_each(), 4u);
  EXPECT_EQ(batch.blocks(0).frustums().detail(), v1::STATIC_DETAIL_TRIANGLES);
  EXPECT_EQ(batch.blocks(1).frustums().view_projections(15), 2);
  EXPECT_EQ(batch.blocks(1).frustums().clip_depth(), v1::CLIP_DEPTH_MINUS_ONE_TO_ONE);
}

TEST(QueryBuilderTest, ViewersAndTargetsAreAddedByRowOrAsColumns) {
  QueryBuilder builder;
  builder.sight().viewer({1, 2, 3}).viewer({4, 5, 6}, 9).target({7, 8, 9}, 1).max_distances({{50}}).pairwise();
  const std::vector<float> eyes(12, 1), samples(9, 2);
  builder.sight().viewers(eyes, 2).targets(samples, 3).viewer_groups({{1, 2}}).target_groups({{3}});
  const v1::QueryBatch batch = builder.build();
  const v1::Sight& rows = batch.blocks(0).sight();
  EXPECT_THAT(rows.viewers(), ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(rows.viewer_groups(), ElementsAre(0, 9));
  EXPECT_THAT(rows.targets(), ElementsAre(7, 8, 9));
  EXPECT_THAT(rows.target_groups(), ElementsAre(1));
  EXPECT_THAT(rows.max_distances(), ElementsAre(50));
  EXPECT_TRUE(rows.pairwise());
  const v1::Sight& columns = batch.blocks(1).sight();
  EXPECT_EQ(columns.eyes_per_viewer(), 2u);
  EXPECT_EQ(columns.samples_per_target(), 3u);
  EXPECT_THAT(columns.viewer_groups(), ElementsAre(1, 2));
  EXPECT_THAT(columns.target_groups(), ElementsAre(3));
}

TEST(QueryBuilderTest, PairsCellsAndPointsToContain) {
  QueryBuilder builder;
  builder.pairs().max_distance(2).layers(1, 6).k(3).after_pair(10, 11);
  builder.cells().max_planes(12).point({1, 2, 3}, 40, {.mask = 2});
  builder.contains().point({1, 2, 3}).point({4, 5, 6}, {.ignore_group = 3});
  const v1::QueryBatch batch = builder.build();
  EXPECT_EQ(batch.blocks(0).pairs().max_distance(), 2);
  EXPECT_EQ(batch.blocks(0).pairs().first_mask(), 1u);
  EXPECT_EQ(batch.blocks(0).pairs().second_mask(), 6u);
  EXPECT_EQ(batch.blocks(0).pairs().k(), 3u);
  EXPECT_EQ(batch.blocks(0).after_id(), 10u);
  EXPECT_EQ(batch.blocks(0).pairs().after_other(), 11u);
  EXPECT_EQ(batch.blocks(1).cells().max_planes(), 12u);
  EXPECT_THAT(batch.blocks(1).cells().points(), ElementsAre(1, 2, 3));
  EXPECT_THAT(batch.blocks(1).cells().max_distances(), ElementsAre(40));
  EXPECT_THAT(batch.blocks(1).masks(), ElementsAre(2));
  EXPECT_THAT(batch.blocks(2).contains().points(), ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(batch.blocks(2).ignore_groups(), ElementsAre(0, 3));
}

TEST(QueryBuilderTest, ViewsNameEpochAndRevision) {
  QueryBuilder builder;
  const v1::QueryBatch later = builder.at_least({4, 12}).max_work(3).explain().by_list().max_reply_bytes(5).build();
  EXPECT_EQ(later.view().at_least(), 12u);
  EXPECT_EQ(later.view().epoch(), 4u);
  EXPECT_EQ(later.max_work(), 3u);
  EXPECT_TRUE(later.explain());
  EXPECT_TRUE(later.by_list());
  EXPECT_EQ(later.max_reply_bytes(), 5u);
  EXPECT_EQ(builder.exactly({4, 13}).build().view().exactly(), 13u);
  EXPECT_FALSE(builder.build().has_view());
}

}  // namespace
}  // namespace locus::client
