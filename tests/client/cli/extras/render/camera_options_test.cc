#include "client/cli/extras/render/camera_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "client/cli/failure.h"

namespace locus::cli {
namespace {

using ::testing::HasSubstr;

constexpr ImageSize kSize = {160, 120};
const Aabbd kBox = {{0, 0, 0}, {10, 20, 30}};

void expect_usage(const absl::Status& status, const std::string& words) {
  EXPECT_EQ(exit_code_of(status), ExitCode::kUsage) << status;
  EXPECT_THAT(status.message(), HasSubstr(words));
}

TEST(ImageSizeTest, IsWrittenAsWidthByHeight) {
  std::istringstream text("1920x1080");
  ImageSize size;
  text >> size;
  EXPECT_FALSE(text.fail());
  EXPECT_EQ(size, (ImageSize{1920, 1080}));
}

TEST(ImageSizeTest, AnythingElseIsRefused) {
  for (const char* wrong :
       {"", "640", "640x", "x480", "0x480", "640x0", "-1x5", "640x480x2", "640,480", "5000000000x1"}) {
    std::istringstream text(wrong);
    ImageSize size;
    text >> size;
    EXPECT_TRUE(text.fail()) << wrong;
  }
}

TEST(CameraOptionsTest, WithoutOptionsTheTargetIsSeenFromAbove) {
  const Camera camera = *camera_of({}, kBox, kSize);
  EXPECT_GT(camera.eye.z, kBox.max.z);
  EXPECT_LT(camera.axes.forward.z, -0.4);
  EXPECT_NEAR(camera.half_height, 0.41421356, 1e-7);
}

TEST(CameraOptionsTest, AnEyeKeepsItsPositionAndLooksAtTheTargetsCentre) {
  const Camera camera = *camera_of({.eye = Triple{5, 10, 115}}, kBox, kSize);
  EXPECT_EQ(camera.eye, (Vec3d{5, 10, 115}));
  EXPECT_EQ(camera.axes.forward, (Vec3d{0, 0, -1}));
}

TEST(CameraOptionsTest, AnEyeLooksAtThePointOrInTheDirectionGiven) {
  const Camera at = *camera_of({.eye = Triple{1, 2, 3}, .look_at = Triple{1, 9, 3}}, kBox, kSize);
  EXPECT_EQ(at.axes.forward, (Vec3d{0, 1, 0}));
  const Camera along = *camera_of({.eye = Triple{1, 2, 3}, .direction = Triple{-4, 0, 0}}, kBox, kSize);
  EXPECT_EQ(along.eye, (Vec3d{1, 2, 3}));
  EXPECT_EQ(along.axes.forward, (Vec3d{-1, 0, 0}));
}

TEST(CameraOptionsTest, ADirectionAloneFramesTheTargetFromThere) {
  const Camera camera = *camera_of({.direction = Triple{0, 3, 0}}, kBox, kSize);
  EXPECT_EQ(camera.axes.forward, (Vec3d{0, 1, 0}));
  EXPECT_LT(camera.eye.y, kBox.min.y);
  EXPECT_NEAR(camera.eye.x, 5, 1e-9);
}

TEST(CameraOptionsTest, AnObjectIsFramedWithAWiderMarginThanTheScene) {
  const Camera scene = *camera_of({}, kBox, kSize), thing = *camera_of({.at = Number64{7}}, kBox, kSize);
  EXPECT_GT(thing.eye.z, scene.eye.z);
}

TEST(CameraOptionsTest, UpIsZUnlessItIsGiven) {
  EXPECT_GT(camera_of({}, kBox, kSize)->axes.up.z, 0.5);
  EXPECT_GT(camera_of({.up = Triple{0, 1, 0}}, kBox, kSize)->axes.up.y, 0.5);
}

TEST(CameraOptionsTest, AViewAlongZHasYUpwardUnlessUpIsGiven) {
  CameraOptions plan = {.direction = Triple{0, 0, -1}};
  EXPECT_EQ(camera_of(plan, kBox, kSize)->axes.up, (Vec3d{0, 1, 0}));
  plan.up = Triple{0, 0, 1};
  expect_usage(camera_of(plan, kBox, kSize).status(), "up is parallel to the view: give another --eye, --dir or --up");
}

TEST(CameraOptionsTest, WithoutPerspectiveTheHeightIsInUnits) {
  const Camera given = *camera_of({.orthographic = 50}, kBox, kSize);
  EXPECT_EQ(given.projection, Projection::kOrthographic);
  EXPECT_EQ(given.half_height, 25);
  const Camera fitted = *camera_of({.direction = Triple{1, 0, 0}, .orthographic = 0}, kBox, kSize);
  EXPECT_NEAR(fitted.half_height, 15, 1);
}

TEST(CameraOptionsTest, OptionsThatGiveNoDirectionAreUsageErrors) {
  expect_usage(check({.eye = Triple{1, 2, 3}, .look_at = Triple{1, 2, 3}}), "--eye and --look-at are the same point");
  expect_usage(check({.direction = Triple{0, 0, 0}}), "--dir 0,0,0 is no direction");
  expect_usage(camera_of({.up = Triple{0, 0, 0}}, kBox, kSize).status(), "--up 0,0,0 is no direction");
  expect_usage(camera_of({.eye = Triple{5, 10, 15}}, kBox, kSize).status(), "the view has no direction");
}

TEST(CameraOptionsTest, OptionsThatContradictEachOtherAreUsageErrors) {
  const Triple eye = {1, 2, 3}, point = {0, 0, 0}, forward = {1, 0, 0};
  expect_usage(check({.eye = eye, .look_at = point, .direction = forward}), "--look-at or --dir");
  expect_usage(check({.look_at = point}), "--look-at needs --eye");
  expect_usage(check({.eye = eye, .look_at = point, .at = Number64{7}}), "--look-at or --at");
  EXPECT_TRUE(check({.eye = eye, .at = Number64{7}}).ok());
}

}  // namespace
}  // namespace locus::cli
