#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"
#include "core/query/columns.h"
#include "server/convert/convert.h"

namespace locus::server {
namespace {

using ::testing::ElementsAre;

TEST(ConvertQueriesTest, ColumnsPointIntoTheMessage) {
  v1::QueryBatch batch;
  v1::Rays* rays = batch.add_blocks()->mutable_rays();
  for (int i = 0; i < 6; ++i) rays->add_origins(static_cast<float>(i));
  batch.mutable_blocks(0)->add_masks(7);
  const absl::StatusOr<QueryBatch> queries = to_queries(batch);
  ASSERT_TRUE(queries.ok()) << queries.status();
  const auto& columns = std::get<RayColumns>(queries->blocks[0].kind);
  EXPECT_EQ(columns.origins.data(), rays->origins().data());
  EXPECT_EQ(columns.origins.size(), 6u);
  EXPECT_TRUE(columns.directions.empty());
  EXPECT_EQ(queries->blocks[0].masks[0], 7u);
}

TEST(ConvertQueriesTest, FiltersAreColumnsOfTheBlock) {
  v1::QueryBatch batch;
  v1::QueryBlock& block = *batch.add_blocks();
  block.mutable_balls();
  block.set_only_groups_each(2);
  for (const uint64_t group : {3u, 4u}) block.add_only_groups(group);
  block.add_tags(5);
  block.add_tag_masks(6);
  block.add_self_ids(7);
  const absl::StatusOr<QueryBatch> queries = to_queries(batch);
  ASSERT_TRUE(queries.ok()) << queries.status();
  const QueryBlock& read = queries->blocks[0];
  EXPECT_EQ(read.only_groups_each, 2u);
  EXPECT_THAT(read.only_groups, ElementsAre(3, 4));
  EXPECT_THAT(read.tags, ElementsAre(5));
  EXPECT_THAT(read.tag_masks, ElementsAre(6));
  EXPECT_THAT(read.self_ids, ElementsAre(7));
}

TEST(ConvertQueriesTest, ZeroIsTheDefaultOfEveryEnum) {
  v1::QueryBatch batch;
  batch.add_blocks()->mutable_rays();
  batch.add_blocks()->mutable_boxes();
  const absl::StatusOr<QueryBatch> queries = to_queries(batch);
  ASSERT_TRUE(queries.ok()) << queries.status();
  EXPECT_EQ(queries->blocks[0].source, Source::kBoth);
  EXPECT_EQ(queries->blocks[0].precision, Precision::kExact);
  EXPECT_TRUE(queries->blocks[0].columns.empty());
  const auto& rays = std::get<RayColumns>(queries->blocks[0].kind);
  EXPECT_EQ(rays.mode, RayMode::kFirst);
  EXPECT_EQ(rays.cull, Cull::kNone);
  EXPECT_EQ(rays.inside, Inside::kSolid);
  EXPECT_EQ(std::get<BoxColumns>(queries->blocks[1].kind).detail, StaticDetail::kInstances);
}

TEST(ConvertQueriesTest, EveryEnumNumberHasItsMeaning) {
  v1::QueryBatch batch;
  v1::QueryBlock* block = batch.add_blocks();
  block->set_source(v1::SOURCE_DYNAMIC);
  block->set_precision(v1::PRECISION_CONSERVATIVE);
  block->add_columns(v1::COLUMN_POSE);
  block->mutable_rays()->set_mode(v1::RAY_MODE_ALL);
  block->mutable_rays()->set_cull(v1::CULL_FRONT);
  block->mutable_rays()->set_inside(v1::INSIDE_HOLLOW);
  batch.add_blocks()->mutable_balls()->set_detail(v1::STATIC_DETAIL_TRIANGLES_SORTED);
  batch.add_blocks()->mutable_nearest()->set_detail(v1::STATIC_DETAIL_TRIANGLES);
  const absl::StatusOr<QueryBatch> queries = to_queries(batch);
  ASSERT_TRUE(queries.ok()) << queries.status();
  EXPECT_EQ(queries->blocks[0].source, Source::kDynamic);
  EXPECT_EQ(queries->blocks[0].precision, Precision::kConservative);
  EXPECT_TRUE(queries->blocks[0].columns.has(Column::kPose));
  EXPECT_FALSE(queries->blocks[0].columns.has(Column::kT));
  const auto& rays = std::get<RayColumns>(queries->blocks[0].kind);
  EXPECT_EQ(rays.mode, RayMode::kAll);
  EXPECT_EQ(rays.cull, Cull::kFront);
  EXPECT_EQ(rays.inside, Inside::kHollow);
  EXPECT_EQ(std::get<BallColumns>(queries->blocks[1].kind).detail, StaticDetail::kTrianglesSorted);
  EXPECT_EQ(std::get<NearestColumns>(queries->blocks[2].kind).detail, StaticDetail::kTriangles);
}

TEST(ConvertQueriesTest, EveryColumnHasItsNameInTheProtocol) {
  for (int number = 1; number < v1::Column_ARRAYSIZE; ++number)
    EXPECT_EQ(v1::Column_Name(number), absl::StrCat("COLUMN_", column_name(static_cast<Column>(number))));
}

TEST(ConvertQueriesTest, EveryFieldOfNearestArrives) {
  v1::QueryBatch batch;
  v1::Nearest* nearest = batch.add_blocks()->mutable_nearest();
  for (const float x : {1.f, 2.f, 3.f}) nearest->add_points(x);
  nearest->add_max_distances(4);
  nearest->set_k(5);
  const absl::StatusOr<QueryBatch> queries = to_queries(batch);
  ASSERT_TRUE(queries.ok()) << queries.status();
  const auto& columns = std::get<NearestColumns>(queries->blocks[0].kind);
  EXPECT_EQ(std::vector<float>(columns.points.begin(), columns.points.end()), (std::vector<float>{1, 2, 3}));
  EXPECT_EQ(std::vector<float>(columns.max_distances.begin(), columns.max_distances.end()), std::vector<float>{4});
  EXPECT_EQ(columns.count, 5u);
  EXPECT_EQ(columns.detail, StaticDetail::kInstances);
}

TEST(ConvertQueriesTest, ViewsSayWhichRevision) {
  v1::View view;
  EXPECT_EQ(to_view(view).kind, View::Kind::kLatest);
  view.set_epoch(5);
  view.set_at_least(0);
  EXPECT_EQ(to_view(view).kind, View::Kind::kAtLeast);
  view.set_exactly(7);
  EXPECT_EQ(to_view(view).kind, View::Kind::kExactly);
  EXPECT_EQ(to_view(view).revision, 7u);
  EXPECT_EQ(to_view(view).epoch, 5u);
}

}  // namespace
}  // namespace locus::server
