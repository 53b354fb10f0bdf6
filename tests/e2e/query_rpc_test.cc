#include <cmath>
#include <functional>
#include <limits>
#include <set>

#include "core/base/limits.h"
#include "tests/support/row_of_balls.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

const float kNan = std::numeric_limits<float>::quiet_NaN();
const float kInfinity = std::numeric_limits<float>::infinity();

class QueryRpcTest : public RowOfBallsTest {
 protected:
  void expect_query_refused(const v1::QueryBatch& batch, const Refused& expected) {
    const std::string before = dump();
    expect_refused(query(batch), expected);
    EXPECT_EQ(dump(), before);
  }
};

v1::QueryBatch ball_at(float x, float radius) {
  v1::QueryBatch batch;
  v1::Balls* balls = batch.add_blocks()->mutable_balls();
  fill(balls->mutable_centers(), {x, 0.f, 0.f});
  balls->add_radii(radius);
  return batch;
}

v1::QueryBatch points_near(std::initializer_list<float> point) {
  v1::QueryBatch batch;
  fill(batch.add_blocks()->mutable_nearest()->mutable_points(), point);
  return batch;
}

v1::QueryBatch box_at(float x, float half) {
  v1::QueryBatch batch;
  v1::Boxes* boxes = batch.add_blocks()->mutable_boxes();
  fill(boxes->mutable_centers(), {x, 0.f, 0.f});
  fill(boxes->mutable_half_extents(), {half, half, half});
  return batch;
}

v1::QueryBatch capsule_between(float from, float to, float radius) {
  v1::QueryBatch batch;
  v1::Capsules* capsules = batch.add_blocks()->mutable_capsules();
  fill(capsules->mutable_starts(), {from, 0.f, 0.f});
  fill(capsules->mutable_ends(), {to, 0.f, 0.f});
  capsules->add_radii(radius);
  return batch;
}

TEST_F(QueryRpcTest, AReplyNamesTheRevisionThatItSaw) {
  const v1::QueryResult result = ask({});
  EXPECT_EQ(result.revision(), 2u);
  EXPECT_EQ(result.epoch(), get("world").epoch());
  EXPECT_EQ(result.blocks_size(), 0);
  EXPECT_FALSE(result.has_work());
}

TEST_F(QueryRpcTest, RaysFindTheFirstAnyAndAllHits) {
  v1::QueryBatch batch = ray_along_x();
  for (const v1::RayMode mode : {v1::RAY_MODE_ANY, v1::RAY_MODE_ALL}) {
    *batch.add_blocks() = batch.blocks(0);
    batch.mutable_blocks(batch.blocks_size() - 1)->mutable_rays()->set_mode(mode);
  }
  const v1::QueryResult result = ask(batch);
  ASSERT_EQ(result.blocks_size(), 3);
  EXPECT_THAT(result.blocks(0).t(), ElementsAre(2.f));
  EXPECT_THAT(result.blocks(0).ids(), ElementsAre(1u));
  EXPECT_THAT(result.blocks(0).triangles(), ElementsAre(0xFFFFFFFFu));
  EXPECT_THAT(result.blocks(0).normals(), IsEmpty());
  EXPECT_EQ(result.blocks(1).hits(), std::string(1, '\1'));
  EXPECT_THAT(result.blocks(1).ids(), IsEmpty());
  // The ray hits the cube's front at x = 9, on the diagonal of two triangles or in one of them, and the cube's back at
  // x = 11.
  const v1::BlockResult& all = result.blocks(2);
  EXPECT_THAT(all.counts(), ElementsAre(static_cast<uint32_t>(all.ids_size())));
  EXPECT_TRUE(std::is_sorted(all.t().begin(), all.t().end()));
  EXPECT_THAT(std::set<uint64_t>(all.ids().begin(), all.ids().end()), ElementsAre(1u, 2u, 3u, 4u, 100u));
}

TEST_F(QueryRpcTest, OverlapsListObjectsAndInstancesInOneOrder) {
  EXPECT_THAT(ask(ball_at(9, 0.5f)).blocks(0).ids(), ElementsAre(3u, 100u));
  EXPECT_THAT(ask(box_at(6, 3)).blocks(0).ids(), ElementsAre(1u, 2u, 3u, 100u));
  EXPECT_THAT(ask(capsule_between(3, 9, 0.5f)).blocks(0).ids(), ElementsAre(1u, 2u, 3u, 100u));
  EXPECT_THAT(ask(capsule_between(9, 9, 0.5f)).blocks(0).ids(), ElementsAre(3u, 100u));
  v1::QueryBatch triangles = ball_at(9, 0.5f);
  triangles.mutable_blocks(0)->mutable_balls()->set_detail(v1::STATIC_DETAIL_TRIANGLES_SORTED);
  triangles.mutable_blocks(0)->set_source(v1::SOURCE_STATIC);
  const v1::QueryResult result = ask(triangles);
  EXPECT_THAT(result.blocks(0).ids(), ElementsAre(100u, 100u));
  EXPECT_THAT(result.blocks(0).triangles(), ElementsAre(8u, 9u));
}

v1::QueryBatch ball_moving(float from, float to, float radius) {
  v1::QueryBatch batch;
  v1::Sweeps* sweeps = batch.add_blocks()->mutable_sweeps();
  fill(sweeps->mutable_starts(), {from, 0.f, 0.f});
  fill(sweeps->mutable_ends(), {to, 0.f, 0.f});
  sweeps->add_radii(radius);
  return batch;
}

TEST_F(QueryRpcTest, SweepsFindWhatAMovingSolidTouches) {
  v1::QueryBatch batch = ball_moving(0, 10, 0.5f);
  v1::QueryBlock& block = *batch.mutable_blocks(0);
  block.set_source(v1::SOURCE_DYNAMIC);
  const v1::BlockResult first = ask(batch).blocks(0);
  ASSERT_EQ(first.ids_size(), 1);
  EXPECT_EQ(first.ids(0), 1u);
  block.mutable_sweeps()->set_mode(v1::RAY_MODE_ALL);
  for (const v1::Column column : {v1::COLUMN_T, v1::COLUMN_ID, v1::COLUMN_NORMAL, v1::COLUMN_POINT})
    block.add_columns(column);
  const v1::BlockResult all = ask(batch).blocks(0);
  EXPECT_THAT(all.ids(), ElementsAre(1u, 2u, 3u));
  EXPECT_EQ(all.t(0), first.t(0));
  EXPECT_EQ(all.normals(0), -1);
  // The contact is at the front of the moving ball, half a unit ahead of its centre.
  EXPECT_FLOAT_EQ(all.points(0), 10 * all.t(0) + 0.5f);
  block.clear_columns();
  block.mutable_sweeps()->set_mode(v1::RAY_MODE_ANY);
  EXPECT_EQ(ask(batch).blocks(0).hits(), std::string(1, '\1'));
}

TEST_F(QueryRpcTest, FrustumsFindWhatIsInView) {
  v1::QueryBatch batch;
  v1::Frustums* frustums = batch.add_blocks()->mutable_frustums();
  // Planes of the box from (2, -1, -1) to (7, 1, 1).
  fill(frustums->mutable_planes(), {1.f, 0.f,  0.f, -2.f, -1.f, 0.f, 0.f, 7.f, 0.f, 1.f, 0.f,  1.f,
                                    0.f, -1.f, 0.f, 1.f,  0.f,  0.f, 1.f, 1.f, 0.f, 0.f, -1.f, 1.f});
  EXPECT_THAT(ask(batch).blocks(0).ids(), ElementsAre(1u, 2u));
  frustums->clear_planes();
  // A matrix that maps the box with the corners (2, -1, 0) and (7, 1, 1) to the clip coordinates x and y in -w .. w, z
  // in 0 .. w.
  fill(frustums->mutable_view_projections(),
       {0.4f, 0.f, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 0.f, 1.f, 0.f, -1.8f, 0.f, 0.f, 1.f});
  EXPECT_THAT(ask(batch).blocks(0).ids(), ElementsAre(1u, 2u));
  frustums->mutable_view_projections()->Set(0, 0);
  expect_query_refused(
      batch, {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_OUT_OF_RANGE, "blocks[0].frustums.view_projections", 0});
}

TEST_F(QueryRpcTest, ContainsFindsTheSolidsAroundPoints) {
  v1::QueryBatch batch;
  fill(batch.add_blocks()->mutable_contains()->mutable_points(), {3.5f, 0.f, 0.f, 0.f, 50.f, 0.f});
  const v1::QueryResult result = ask(batch);
  EXPECT_THAT(result.blocks(0).counts(), ElementsAre(1u, 0u));
  EXPECT_THAT(result.blocks(0).ids(), ElementsAre(1u));
}

TEST_F(QueryRpcTest, SightIsAMatrixOfBytes) {
  v1::QueryBatch batch;
  v1::Sight* sight = batch.add_blocks()->mutable_sight();
  fill(sight->mutable_viewers(), {0.f, 0.f, 0.f, 4.5f, 0.f, 0.f});
  fill(sight->mutable_targets(), {1.f, 0.f, 0.f, 4.6f, 0.f, 0.f});
  EXPECT_EQ(ask(batch).blocks(0).sight(), std::string("\1\0\0\1", 4));
  sight->set_pairwise(true);
  EXPECT_EQ(ask(batch).blocks(0).sight(), std::string("\1\1", 2));
}

TEST_F(QueryRpcTest, PairsAndCellsAreRows) {
  v1::QueryBatch batch;
  batch.add_blocks()->mutable_pairs()->set_max_distance(1);
  batch.mutable_blocks(0)->mutable_pairs()->set_k(1);
  const v1::BlockResult pairs = ask(batch).blocks(0);
  EXPECT_THAT(pairs.ids(), ElementsAre(1u, 2u, 3u, 4u));
  EXPECT_THAT(pairs.others(), ElementsAre(2u, 1u, 2u, 3u));
  EXPECT_THAT(pairs.t(), ElementsAre(1.f, 1.f, 1.f, 1.f));
  v1::QueryBatch free;
  v1::Cells* cells = free.add_blocks()->mutable_cells();
  fill(cells->mutable_points(), {4.5f, 0.f, 0.f});
  cells->add_max_distances(3);
  const v1::BlockResult space = ask(free).blocks(0);
  EXPECT_THAT(space.ids(), ElementsAre(0u, 1u, 2u));
  EXPECT_THAT(space.t(), ElementsAre(3.f, 0.5f, 0.5f));
}

TEST_F(QueryRpcTest, AnchorsCountsAndPagesAreServed) {
  v1::QueryBatch batch = ball_at(0, 2.5f);
  batch.mutable_blocks(0)->add_anchor_ids(2);
  EXPECT_THAT(ask(batch).blocks(0).ids(), ElementsAre(1u, 3u));
  batch.mutable_blocks(0)->set_anchor_ids(0, 77);
  EXPECT_THAT(ask(batch).blocks(0).unanchored(), ElementsAre(0u));
  batch.mutable_blocks(0)->set_anchor_ids(0, 2);
  batch.mutable_blocks(0)->set_count_only(true);
  EXPECT_THAT(ask(batch).blocks(0).counts(), ElementsAre(2u));
  EXPECT_THAT(ask(batch).blocks(0).ids(), IsEmpty());
  v1::QueryBatch page = ray_along_x();
  page.mutable_blocks(0)->mutable_rays()->add_after_ts(2);
  EXPECT_THAT(ask(page).blocks(0).ids(), ElementsAre(2u));
}

TEST_F(QueryRpcTest, NearestListsObjectsAndInstancesByDistance) {
  v1::QueryBatch batch = points_near({10.f, 0.f, 0.f});
  EXPECT_THAT(ask(batch).blocks(0).ids(), ElementsAre(3u));
  batch.mutable_blocks(0)->mutable_nearest()->set_k(3);
  for (const v1::Column column : {v1::COLUMN_T, v1::COLUMN_ID, v1::COLUMN_TRIANGLE, v1::COLUMN_POINT})
    batch.mutable_blocks(0)->add_columns(column);
  const v1::QueryResult result = ask(batch);
  const v1::BlockResult& block = result.blocks(0);
  EXPECT_THAT(block.counts(), ElementsAre(3u));
  EXPECT_THAT(block.ids(), ElementsAre(3u, 4u, 100u));
  EXPECT_THAT(block.t(), ElementsAre(0.f, 1.f, 1.f));
  EXPECT_THAT(block.triangles(), ElementsAre(0xFFFFFFFFu, 0xFFFFFFFFu, 0u));
  EXPECT_EQ(block.points_size(), 9);
  EXPECT_THAT(block.truncated(), IsEmpty());
  batch.mutable_blocks(0)->mutable_nearest()->add_max_distances(0.5f);
  EXPECT_THAT(ask(batch).blocks(0).ids(), ElementsAre(3u));
}

TEST_F(QueryRpcTest, SourceMasksAndIgnoresFilterResults) {
  v1::QueryBatch batch = ray_along_x();
  v1::QueryBlock* block = batch.mutable_blocks(0);
  block->set_source(v1::SOURCE_STATIC);
  EXPECT_THAT(ask(batch).blocks(0).ids(), ElementsAre(100u));
  block->set_source(v1::SOURCE_DYNAMIC);
  fill(block->mutable_ignore_ids(), {uint64_t{1}, uint64_t{2}, uint64_t{999}});
  EXPECT_THAT(ask(batch).blocks(0).ids(), ElementsAre(3u));
  block->add_masks(2);
  EXPECT_THAT(ask(batch).blocks(0).ids(), ElementsAre(0u));
}

TEST_F(QueryRpcTest, OnlyRequestedColumnsAreReturnedUpToAllOfThem) {
  v1::QueryBatch batch = ray_along_x();
  for (int column = v1::COLUMN_T; column <= v1::COLUMN_POSE; ++column)
    batch.mutable_blocks(0)->add_columns(static_cast<v1::Column>(column));
  const v1::BlockResult all = ask(batch).blocks(0);
  EXPECT_THAT(all.uvs(), ElementsAre(0.f, 0.f));
  EXPECT_THAT(all.normals(), ElementsAre(-1.f, 0.f, 0.f));
  EXPECT_THAT(all.points(), ElementsAre(2.f, 0.f, 0.f));
  EXPECT_THAT(all.groups(), ElementsAre(0u));
  EXPECT_THAT(all.tags(), ElementsAre(0u));
  EXPECT_THAT(all.layers(), ElementsAre(1u));
  EXPECT_THAT(all.positions(), ElementsAre(3.0, 0.0, 0.0));
  EXPECT_THAT(all.rotations(), ElementsAre(0.f, 0.f, 0.f, 1.f));
  batch.mutable_blocks(0)->clear_columns();
  batch.mutable_blocks(0)->add_columns(v1::COLUMN_T);
  const v1::BlockResult one = ask(batch).blocks(0);
  EXPECT_THAT(one.t(), ElementsAre(2.f));
  EXPECT_THAT(one.ids(), IsEmpty());
}

TEST_F(QueryRpcTest, OneOriginServes262144DirectionsInABlockWithARotation) {
  v1::QueryBatch batch;
  v1::QueryBlock& block = *batch.add_blocks();
  block.add_columns(v1::COLUMN_T);
  fill(block.mutable_rotation(), {0.f, 0.f, std::sqrt(0.5f), std::sqrt(0.5f)});  // turns -y to x
  fill(block.mutable_rays()->mutable_origins(), {0.f, 0.f, 0.f});
  auto& directions = *block.mutable_rays()->mutable_directions();
  directions.Resize(3 * limits::kMaxRays, 0.f);
  for (uint32_t i = 0; i < limits::kMaxRays; ++i) directions.Set(static_cast<int>(3 * i + 1), i % 2 == 0 ? -1.f : 1.f);
  const v1::QueryResult result = ask(batch);
  ASSERT_EQ(result.blocks(0).t_size(), static_cast<int>(limits::kMaxRays));
  for (uint32_t i = 0; i < limits::kMaxRays; ++i) {
    const float t = result.blocks(0).t(static_cast<int>(i));
    ASSERT_TRUE(i % 2 == 0 ? std::abs(t - 2) < 1e-6f : std::isinf(t)) << i << ": " << t;
  }
}

TEST_F(QueryRpcTest, LookupsFindByIdAndByGroup) {
  v1::UpdateBatch relabel;
  fill(relabel.add_relabels()->mutable_ids(), {uint64_t{2}, uint64_t{4}});
  relabel.mutable_relabels(0)->add_groups(7);
  relabel.mutable_relabels(0)->add_layers(0);
  ASSERT_TRUE(apply(relabel).ok());
  v1::QueryBatch batch;
  fill(batch.add_blocks()->mutable_lookup()->mutable_ids(), {uint64_t{100}, uint64_t{55}, uint64_t{4}});
  fill(batch.add_blocks()->mutable_lookup()->mutable_groups(), {uint64_t{7}, uint64_t{8}});
  const v1::QueryResult result = ask(batch);
  EXPECT_THAT(result.blocks(0).ids(), ElementsAre(100u, 0u, 4u));
  EXPECT_THAT(result.blocks(0).positions(), ElementsAre(10., 0., 0., 0., 0., 0., 12., 0., 0.));
  EXPECT_THAT(result.blocks(1).counts(), ElementsAre(2u, 0u));
  EXPECT_THAT(result.blocks(1).ids(), ElementsAre(2u, 4u));
}

TEST_F(QueryRpcTest, TruncatedOverlapsAreListedAndContinueAfterAnId) {
  v1::QueryBatch batch = box_at(6, 100);
  batch.mutable_blocks(0)->set_max_results(2);
  EXPECT_THAT(ask(batch).blocks(0).ids(), ElementsAre(1u, 2u));
  EXPECT_THAT(ask(batch).blocks(0).truncated(), ElementsAre(0u));
  batch.mutable_blocks(0)->set_after_id(2);
  batch.mutable_blocks(0)->set_max_results(3);
  const v1::QueryResult rest = ask(batch);
  EXPECT_THAT(rest.blocks(0).ids(), ElementsAre(3u, 4u, 100u));
  EXPECT_THAT(rest.blocks(0).truncated(), IsEmpty());
}

TEST_F(QueryRpcTest, RepliesStayBelowTheSizeThatIsAskedFor) {
  ASSERT_TRUE(apply(insert_balls(1000, 3000)).ok());
  v1::QueryBatch batch;
  for (int i = 0; i < 8; ++i) {
    *batch.add_blocks() = box_at(6, 1e6f).blocks(0);
    batch.mutable_blocks(i)->set_max_results(100000);
  }
  for (const uint32_t bytes : {5000u, 50000u}) {
    batch.set_max_reply_bytes(bytes);
    const v1::QueryResult result = ask(batch);
    EXPECT_LE(result.ByteSizeLong(), bytes);
    EXPECT_GT(result.ByteSizeLong(), bytes / 2);
    ASSERT_EQ(result.blocks_size(), 8);
    EXPECT_THAT(result.blocks(7).truncated(), ElementsAre(0u));
  }
  batch = ray_along_x();
  batch.set_max_reply_bytes(1);
  const v1::Error error = error_of(query(batch));
  expect_error(error, {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_LIMIT, "max_reply_bytes"});
}

TEST_F(QueryRpcTest, ExplainReportsTheWorkOfTheBatchAndItsBlocks) {
  v1::QueryBatch batch = ray_along_x();
  *batch.add_blocks() = ball_at(9, 0.5f).blocks(0);
  v1::QueryResult plain = ask(batch);
  EXPECT_FALSE(plain.has_work());
  batch.set_explain(true);
  v1::QueryResult explained = ask(batch);
  ASSERT_TRUE(explained.has_work());
  EXPECT_GT(explained.work().tests(), 0u);
  EXPECT_GT(explained.work().nodes(), 0u);
  EXPECT_GT(explained.work().cells(), 0u);
  EXPECT_GT(explained.work().nanoseconds(), 0u);
  EXPECT_EQ(explained.work().tests(), explained.blocks(0).work().tests() + explained.blocks(1).work().tests());
  EXPECT_EQ(explained.work().nanoseconds(),
            explained.blocks(0).work().nanoseconds() + explained.blocks(1).work().nanoseconds());
  explained.clear_work();
  for (v1::BlockResult& block : *explained.mutable_blocks()) block.clear_work();
  EXPECT_EQ(explained.SerializeAsString(), plain.SerializeAsString());
}

TEST_F(QueryRpcTest, AWorkBudgetTruncatesResultsAndListsThem) {
  ASSERT_TRUE(apply(insert_balls(1000, 3000)).ok());
  v1::QueryBatch batch;
  for (int i = 0; i < 100; ++i) *batch.add_blocks() = box_at(6, 1e6f).blocks(0);
  batch.set_max_work(1);
  const v1::QueryResult result = ask(batch);
  ASSERT_EQ(result.blocks_size(), 100);
  EXPECT_THAT(result.blocks(99).truncated(), ElementsAre(0u));
}

TEST_F(QueryRpcTest, WrongValuesRefuseTheBatchAndAreNamed) {
  const auto refused = [this](v1::QueryBatch batch, const std::string& field, v1::Reason reason,
                              std::optional<uint32_t> index, const std::function<void(v1::QueryBlock*)>& spoil) {
    SCOPED_TRACE(field);
    *batch.add_blocks() = batch.blocks(0);
    spoil(batch.mutable_blocks(1));
    expect_query_refused(batch, {grpc::StatusCode::INVALID_ARGUMENT, reason, "blocks[1]." + field, index});
  };
  const v1::Reason not_finite = v1::REASON_NOT_FINITE;
  const v1::Reason range = v1::REASON_OUT_OF_RANGE;
  const v1::Reason length = v1::REASON_COLUMN_LENGTH;
  const auto two = [](v1::QueryBatch batch) {
    v1::Rays* rays = batch.mutable_blocks(0)->mutable_rays();
    fill(rays->mutable_origins(), {0.f, 0.f, 0.f, 1.f, 1.f, 1.f});
    fill(rays->mutable_directions(), {1.f, 0.f, 0.f, 1.f, 1.f, 1.f});
    return batch;
  };
  const v1::QueryBatch rays = two(ray_along_x());
  refused(rays, "frame", not_finite, {}, [](auto* block) { block->mutable_frame()->set_z(kNan); });
  refused(rays, "rays.origins", not_finite, 1, [](auto* block) { block->mutable_rays()->set_origins(4, kNan); });
  refused(rays, "rays.origins", range, 1, [](auto* block) { block->mutable_rays()->set_origins(4, 2e9f); });
  refused(rays, "rays.origins", length, {}, [](auto* block) { block->mutable_rays()->add_origins(0); });
  refused(rays, "rays.directions", not_finite, 1,
          [](auto* block) { block->mutable_rays()->set_directions(5, kInfinity); });
  refused(rays, "rays.directions", range, 1, [](auto* block) {
    fill(block->mutable_rays()->mutable_directions(), {1.f, 0.f, 0.f, 0.f, 0.f, 0.f});
  });
  refused(rays, "rays.directions", length, {}, [](auto* block) { block->mutable_rays()->clear_directions(); });
  refused(rays, "rays.t_max", not_finite, 0, [](auto* block) { block->mutable_rays()->add_t_max(kNan); });
  refused(rays, "rays.t_max", range, 0, [](auto* block) { block->mutable_rays()->add_t_max(-1); });
  refused(rays, "masks", length, {}, [](auto* block) { fill(block->mutable_masks(), {1u, 2u, 3u}); });
  refused(rays, "ignore_groups", length, {}, [](auto* block) {
    fill(block->mutable_ignore_groups(), {uint64_t{1}, uint64_t{2}, uint64_t{3}});
  });
  const v1::QueryBatch balls = ball_at(0, 1);
  refused(balls, "balls.radii", range, 0, [](auto* block) { block->mutable_balls()->set_radii(0, -1); });
  refused(balls, "balls.radii", not_finite, 0, [](auto* block) { block->mutable_balls()->set_radii(0, kInfinity); });
  refused(balls, "balls.radii", length, {}, [](auto* block) { block->mutable_balls()->clear_radii(); });
  refused(balls, "balls.centers", not_finite, 0, [](auto* block) { block->mutable_balls()->set_centers(0, kNan); });
  const v1::QueryBatch points = points_near({0.f, 0.f, 0.f});
  refused(points, "nearest.max_distances", not_finite, 0,
          [](auto* block) { block->mutable_nearest()->add_max_distances(kNan); });
  refused(points, "nearest.max_distances", range, 0,
          [](auto* block) { block->mutable_nearest()->add_max_distances(-1); });
  refused(points, "nearest.points", length, {}, [](auto* block) { block->mutable_nearest()->add_points(1); });
  const v1::QueryBatch boxes = box_at(0, 1);
  refused(boxes, "boxes.half_extents", range, 0, [](auto* block) { block->mutable_boxes()->set_half_extents(2, -1); });
  refused(capsule_between(0, 1, 1), "capsules.radii", range, 0,
          [](auto* block) { block->mutable_capsules()->set_radii(0, -1); });
  const v1::QueryBatch sweeps = ball_moving(0, 1, 1);
  refused(sweeps, "sweeps.radii", range, 0, [](auto* block) { block->mutable_sweeps()->set_radii(0, 0); });
  refused(sweeps, "sweeps.radii", length, {}, [](auto* block) { block->mutable_sweeps()->clear_radii(); });
  refused(sweeps, "sweeps.ends", length, {}, [](auto* block) { block->mutable_sweeps()->add_ends(1); });
  refused(sweeps, "sweeps.radii", v1::REASON_MALFORMED, {}, [](auto* block) {
    fill(block->mutable_sweeps()->mutable_half_extents(), {1.f, 1.f, 1.f});
  });
  refused(sweeps, "sweeps.rotations", v1::REASON_MALFORMED, {}, [](auto* block) {
    fill(block->mutable_sweeps()->mutable_rotations(), {0.f, 0.f, 0.f, 1.f});
  });
  refused(sweeps, "sweeps.half_extents", range, 0, [](auto* block) {
    block->mutable_sweeps()->clear_radii();
    fill(block->mutable_sweeps()->mutable_half_extents(), {0.f, 0.f, 0.f});
  });
  refused(sweeps, "sweeps.half_axes", v1::REASON_NOT_FINITE, 0, [](auto* block) {
    fill(block->mutable_sweeps()->mutable_half_axes(), {0.f, std::numeric_limits<float>::quiet_NaN(), 1.f});
  });
  refused(boxes, "boxes.rotations", range, 0, [](auto* block) {
    fill(block->mutable_boxes()->mutable_rotations(), {0.f, 0.f, 0.f, 3.f});
  });
  refused(boxes, "boxes.rotations", length, {}, [](auto* block) { block->mutable_boxes()->add_rotations(1); });
  refused(boxes, "lookup.groups", range, 0, [](auto* block) { block->mutable_lookup()->add_groups(0); });
}

TEST_F(QueryRpcTest, WrongFormRefusesTheBatchAndIsNamed) {
  const auto refused = [this](const std::string& field, std::optional<uint32_t> index,
                              const std::function<void(v1::QueryBlock*)>& spoil) {
    SCOPED_TRACE(field);
    v1::QueryBatch batch = ray_along_x();
    spoil(batch.mutable_blocks(0));
    expect_query_refused(batch, {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "blocks[0]" + field, index});
  };
  refused("", {}, [](auto* block) { block->clear_kind(); });
  refused(".source", {}, [](auto* block) { block->set_source(static_cast<v1::Source>(4)); });
  refused(".precision", {}, [](auto* block) { block->set_precision(static_cast<v1::Precision>(-1)); });
  refused(".rays.mode", {}, [](auto* block) { block->mutable_rays()->set_mode(static_cast<v1::RayMode>(4)); });
  refused(".rays.cull", {}, [](auto* block) { block->mutable_rays()->set_cull(static_cast<v1::Cull>(99)); });
  refused(".rays.inside", {}, [](auto* block) { block->mutable_rays()->set_inside(static_cast<v1::Inside>(4)); });
  refused(".balls.detail", {},
          [](auto* block) { block->mutable_balls()->set_detail(static_cast<v1::StaticDetail>(4)); });
  refused(".boxes.detail", {},
          [](auto* block) { block->mutable_boxes()->set_detail(static_cast<v1::StaticDetail>(4)); });
  refused(".nearest.detail", {},
          [](auto* block) { block->mutable_nearest()->set_detail(static_cast<v1::StaticDetail>(4)); });
  refused(".columns", 1, [](auto* block) {
    block->add_columns(v1::COLUMN_ID);
    block->add_columns(static_cast<v1::Column>(99));
  });
  refused(".columns", 0, [](auto* block) { block->add_columns(v1::COLUMN_UNSPECIFIED); });
  refused(".columns", {}, [](auto* block) {
    block->mutable_balls();
    block->add_columns(v1::COLUMN_UV);
  });
  refused(".lookup", {}, [](auto* block) { block->mutable_lookup(); });
  refused(".lookup", {}, [](auto* block) {
    block->mutable_lookup()->add_ids(1);
    block->mutable_lookup()->add_groups(1);
  });
}

TEST_F(QueryRpcTest, LimitsOfABatchAreNamedWithWhatWasAsked) {
  const auto refused = [this](const v1::QueryBatch& batch, const std::string& field, const std::string& limit,
                              double value, double asked) {
    const v1::Error error = error_of(query(batch));
    expect_error(error, {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_LIMIT, field});
    EXPECT_EQ(error.limit(), limit);
    EXPECT_EQ(error.limit_value(), value);
    EXPECT_EQ(error.asked(), asked);
  };
  v1::QueryBatch batch;
  for (uint32_t i = 0; i <= limits::kMaxBlocks; ++i) batch.add_blocks();
  refused(batch, "blocks", "blocks", limits::kMaxBlocks, limits::kMaxBlocks + 1.0);
  batch = ray_along_x();
  batch.mutable_blocks(0)->mutable_rays()->mutable_origins()->Resize(3 * (static_cast<int>(limits::kMaxRays) + 1), 0);
  refused(batch, "blocks", "rays", limits::kMaxRays, limits::kMaxRays + 1.0);
  batch = points_near({0.f, 0.f, 0.f});
  batch.mutable_blocks(0)->mutable_nearest()->mutable_points()->Resize(3 * (static_cast<int>(limits::kMaxQueries) + 1),
                                                                       0);
  refused(batch, "blocks", "queries", limits::kMaxQueries, limits::kMaxQueries + 1.0);
  batch = ray_along_x();
  for (uint32_t i = 0; i <= limits::kMaxIgnoredIds; ++i) batch.mutable_blocks(0)->add_ignore_ids(i + 1);
  v1::QueryBatch points = points_near({0.f, 0.f, 0.f});
  points.mutable_blocks(0)->mutable_nearest()->set_k(limits::kMaxNearest + 1);
  refused(points, "blocks[0].nearest.k", "nearest", limits::kMaxNearest, limits::kMaxNearest + 1.0);
  refused(batch, "blocks[0].ignore_ids", "ignored_ids", limits::kMaxIgnoredIds, limits::kMaxIgnoredIds + 1.0);
  batch = ray_along_x();
  batch.mutable_blocks(0)->set_only_groups_each(limits::kMaxOnlyGroups + 1);
  refused(batch, "blocks[0].only_groups_each", "only_groups", limits::kMaxOnlyGroups, limits::kMaxOnlyGroups + 1.0);
  batch = ray_along_x();
  batch.mutable_blocks(0)->set_max_results(limits::kMaxMaxResults + 1);
  refused(batch, "blocks[0].max_results", "max_results", limits::kMaxMaxResults, limits::kMaxMaxResults + 1.0);
  batch = ray_along_x();
  batch.set_max_reply_bytes(limits::kMaxReplyBytes + 1);
  refused(batch, "max_reply_bytes", "max_reply_bytes", limits::kMaxReplyBytes, limits::kMaxReplyBytes + 1.0);
}

TEST_F(QueryRpcTest, RepliesAreTheSameBytesOnOneAndFourThreads) {
  ASSERT_TRUE(apply(insert_balls(1000, 3000)).ok());
  v1::QueryBatch batch;
  v1::Rays* rays = batch.add_blocks()->mutable_rays();
  for (int i = 0; i < 5000; ++i)
    for (int axis = 0; axis < 3; ++axis) rays->add_origins(static_cast<float>((i * 7919 + axis * 104729) % 1000) / 10);
  fill(rays->mutable_directions(), {1.f, 0.25f, -0.5f});
  std::vector<std::string> replies;
  for (const uint32_t threads : {1u, 4u}) {
    server::ServerConfig config = test_config();
    config.threads = threads;
    RunningServer other(config);
    grpc::ClientContext create_context;
    v1::CreateSceneRequest scene;
    scene.set_name("world");
    v1::CreateSceneResponse created;
    ASSERT_TRUE(other.stubs().scenes->CreateScene(&create_context, scene, &created).ok());
    grpc::ClientContext update_context;
    v1::ApplyUpdatesRequest update;
    update.set_scene("world");
    *update.mutable_batch() = insert_balls(1, 3000);
    v1::ApplyUpdatesResponse applied;
    ASSERT_TRUE(other.stubs().updates->ApplyUpdates(&update_context, update, &applied).ok());
    grpc::ClientContext query_context;
    v1::QueryRequest request;
    request.set_scene("world");
    *request.mutable_batch() = batch;
    v1::QueryResponse response;
    ASSERT_TRUE(other.stubs().queries->Query(&query_context, request, &response).ok());
    response.mutable_result()->clear_epoch();
    replies.push_back(response.SerializeAsString());
  }
  EXPECT_EQ(replies[0], replies[1]);
}

}  // namespace
}  // namespace locus::test
