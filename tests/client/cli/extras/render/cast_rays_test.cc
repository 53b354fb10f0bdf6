#include "client/cli/extras/render/cast_rays.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "client/lib/result_rows.h"
#include "tests/client/cli/extras/render/render_scene.h"

namespace locus::cli {
namespace {

using ::testing::Each;
using ::testing::HasSubstr;

constexpr ImageSize kLargeSize = {120, 100};  // so many pixels that their rays are more than one batch

// Scene, far from the world's origin, with a ball above the ground of a city. The camera looks down from above.
class CastRaysTest : public ::testing::Test {
 protected:
  void SetUp() override {
    server_.create("arena");
    server_.place("arena", 1, server_.upload_city(12), {kOut, 0, 0}, {}, 4);
    move_ball(10);
    options_.scene = "arena";
    options_.revision = server_.revision("arena");
    camera_ = {.eye = {kOut, 0, 40}, .axes = *view_axes({0, 0, -1}, {0, 1, 0}), .half_height = 0.25};
  }

  void move_ball(double height) {
    client::UpdateBuilder updates;
    updates.upsert().insert_ball(7, client::Double3{kOut, 0, height}, 2, {.layers = 2});
    server_.apply("arena", updates);
  }

  CastResult cast() {
    absl::StatusOr<CastResult> result = cast_rays(server_.client(), camera_, kLargeSize, options_);
    EXPECT_TRUE(result.ok()) << result.status();
    return result.ok() ? *std::move(result) : CastResult{RayImage(kLargeSize)};
  }

  static size_t middle() { return kLargeSize.width * (kLargeSize.height / 2) + kLargeSize.width / 2; }
  static constexpr double kOut = 123456789.25;

  RenderServer server_;
  Camera camera_;
  CastOptions options_;
};

TEST_F(CastRaysTest, EveryPixelHoldsTheHitOfItsRay) {
  const CastResult result = cast();
  EXPECT_NEAR(result.image.t[middle()], 28, 0.1);
  EXPECT_EQ(result.image.ids[middle()], 7u);
  EXPECT_TRUE(result.image.hit_object(middle()));
  EXPECT_GT(result.image.normals[middle()].z, 0.9f);
  EXPECT_NEAR(result.image.t[0], 40, 1e-5);
  EXPECT_EQ(result.image.ids[0], 1u);
  EXPECT_EQ(result.image.normals[0], (Vec3f{0, 0, 1}));
  EXPECT_EQ(result.image.hits(), kLargeSize.pixels());
  EXPECT_TRUE(result.image.work.empty());
}

TEST_F(CastRaysTest, AllRaysSeeTheGivenRevisionAfterTheSceneHasChanged) {
  const RayImage before = cast().image;
  move_ball(20);
  const CastResult after = cast();
  EXPECT_EQ(after.first_revision, options_.revision.revision);
  EXPECT_EQ(after.last_revision, options_.revision.revision);
  EXPECT_EQ(depth_sha256(after.image), depth_sha256(before));
}

TEST_F(CastRaysTest, LivePicturesSeeTheLatestRevision) {
  move_ball(20);
  options_.revisions = Revisions::kLive;
  const CastResult live = cast();
  EXPECT_EQ(live.last_revision, options_.revision.revision + 1);
  EXPECT_NEAR(live.image.t[middle()], 18, 0.1);
}

TEST_F(CastRaysTest, ADroppedRevisionIsExplained) {
  for (int i = 0; i < 70; ++i) move_ball(10 + 0.1 * i);
  const absl::Status status = cast_rays(server_.client(), camera_, kLargeSize, options_).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kOutOfRange);
  EXPECT_THAT(status.message(), HasSubstr("the scene changed faster than its picture was taken"));
  EXPECT_THAT(status.message(), HasSubstr("--live"));
}

TEST_F(CastRaysTest, ErrorsOfTheServerAreReturned) {
  options_.scene = "nowhere";
  EXPECT_EQ(cast_rays(server_.client(), camera_, kLargeSize, options_).status().code(), absl::StatusCode::kNotFound);
  options_.scene = "arena";
  camera_.eye.x = 2e9;
  EXPECT_EQ(cast_rays(server_.client(), camera_, kLargeSize, options_).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST_F(CastRaysTest, SourceMaskAndCullSelectTheHits) {
  options_.source = v1::SOURCE_STATIC;
  EXPECT_THAT(cast().image.ids, Each(1u));
  options_.source = v1::SOURCE_UNSPECIFIED;
  options_.mask = 2;
  EXPECT_EQ(cast().image.ids[0], 0u);
  EXPECT_TRUE(std::isinf(cast().image.t[0]));
  options_.mask = 1;
  options_.cull = v1::CULL_BACK;
  camera_.eye.z = -0.25;  // inside the ground slab: rays downward hit the back of its bottom, which is culled
  EXPECT_THAT(cast().image.ids, Each(0u));
}

TEST_F(CastRaysTest, WorkIsReportedForEachRayAndChangesNoAnswer) {
  const RayImage without = cast().image;
  options_.work = WorkReport::kReported;
  const RayImage with = cast().image;
  EXPECT_EQ(depth_sha256(with), depth_sha256(without));
  EXPECT_EQ(ids_sha256(with), ids_sha256(without));
  ASSERT_EQ(with.work.size(), kLargeSize.pixels());
  for (const RayWork& work : with.work) EXPECT_GT(work.nodes + work.tests, 0u);
  EXPECT_GT(with.work[middle()].cells, 0u);
}

TEST_F(CastRaysTest, OrthographicRaysStartInAPlane) {
  camera_.projection = Projection::kOrthographic;
  camera_.half_height = 4;
  const RayImage image = cast().image;
  EXPECT_NEAR(image.t[0], 40, 1e-5);
  EXPECT_EQ(image.ids[middle()], 7u);
  // The ball, 4 units wide, covers pi 2^2 of the picture's 8 x 9.6 square units.
  uint64_t ball = 0;
  for (const uint64_t id : image.ids) ball += id == 7;
  EXPECT_NEAR(static_cast<double>(ball) / static_cast<double>(kLargeSize.pixels()), 4 * M_PI / (8 * 9.6), 0.005);
}

TEST_F(CastRaysTest, ProgressNeverDecreasesOrExceedsTheTotal) {
  uint64_t last = 0;
  int calls = 0;
  const auto progress = [&](uint64_t done) {
    EXPECT_GE(done, last);
    EXPECT_LE(done, kLargeSize.pixels());
    last = done;
    ++calls;
  };
  ASSERT_TRUE(cast_rays(server_.client(), camera_, kLargeSize, options_, progress).ok());
  EXPECT_EQ(calls, 2);
}

}  // namespace
}  // namespace locus::cli
