#include "client/cli/extras/render/camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace locus::cli {
namespace {

using ::testing::HasSubstr;

constexpr double kNear = 1e-12;

Camera looking_along_y(Projection projection) {
  return {.eye = {1, 2, 3}, .axes = *view_axes({0, 5, 0}, {0, 0, 2}), .projection = projection, .half_height = 0.5};
}

TEST(ViewAxesTest, AreUnitPerpendicularAndHaveUpUpward) {
  const Vec3d forward = {3, -2, -1}, up = {0.2, 0, 7};
  const ViewAxes axes = *view_axes(forward, up);
  for (const Vec3d axis : {axes.right, axes.up, axes.forward}) EXPECT_NEAR(squared_length(axis), 1, kNear);
  EXPECT_NEAR(dot(axes.right, axes.up), 0, kNear);
  EXPECT_NEAR(dot(axes.right, axes.forward), 0, kNear);
  EXPECT_NEAR(dot(axes.up, axes.forward), 0, kNear);
  EXPECT_GT(dot(axes.up, up), 0);
  EXPECT_GT(dot(axes.forward, forward), 0);
  EXPECT_NEAR(dot(cross(axes.right, axes.up), axes.forward), -1, kNear);
}

TEST(ViewAxesTest, AViewNorthWithZUpHasEastToTheRight) {
  const ViewAxes axes = *view_axes({0, 1, 0}, {0, 0, 1});
  EXPECT_EQ(axes.right, (Vec3d{1, 0, 0}));
  EXPECT_EQ(axes.up, (Vec3d{0, 0, 1}));
}

TEST(ViewAxesTest, RefuseAViewOrAnUpWithoutDirection) {
  const double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const Vec3d none : {Vec3d{0, 0, 0}, Vec3d{kNan, 0, 1}, Vec3d{0, HUGE_VAL, 0}}) {
    EXPECT_THAT(view_axes(none, {0, 0, 1}).status().message(), HasSubstr("the view has no direction"));
    EXPECT_THAT(view_axes({1, 0, 0}, none).status().message(), HasSubstr("up has no direction"));
  }
}

TEST(ViewAxesTest, RefuseAnUpAlongOrAgainstTheView) {
  for (const Vec3d up : {Vec3d{0, 0, 1}, Vec3d{0, 0, -7}, Vec3d{1e-8, 0, 1}}) {
    EXPECT_THAT(view_axes({0, 0, -3}, up).status().message(), HasSubstr("up is parallel to the view"));
  }
  EXPECT_TRUE(view_axes({0, 0, -3}, {1e-4, 0, 1}).ok());
}

TEST(RayThroughTest, TheMiddlePixelLooksStraightAhead) {
  const CameraRay ray = ray_through(looking_along_y(Projection::kPerspective), {3, 5}, 1, 2);
  EXPECT_EQ(ray.origin, (Vec3f{0, 0, 0}));
  EXPECT_EQ(ray.direction, (Vec3f{0, 1, 0}));
}

TEST(RayThroughTest, RowsGoDownAndColumnsGoRightByTheSameAngleOfView) {
  // 4 x 2 pixels cover 2 x 1 units at distance 1: pixel centres are at +-0.75 and +-0.25 across, +-0.25 vertically.
  const Camera camera = looking_along_y(Projection::kPerspective);
  EXPECT_EQ(ray_through(camera, {4, 2}, 0, 0).direction, (Vec3f{-0.75f, 1, 0.25f}));
  EXPECT_EQ(ray_through(camera, {4, 2}, 3, 0).direction, (Vec3f{0.75f, 1, 0.25f}));
  EXPECT_EQ(ray_through(camera, {4, 2}, 1, 1).direction, (Vec3f{-0.25f, 1, -0.25f}));
}

TEST(RayThroughTest, AHitsTIsItsDepthAlongTheView) {
  Camera camera = looking_along_y(Projection::kPerspective);
  camera.axes = *view_axes({1, 2, -0.5}, {0, 0, 1});
  for (uint32_t pixel = 0; pixel < 7; ++pixel) {
    const CameraRay ray = ray_through(camera, {7, 7}, pixel, 6 - pixel);
    EXPECT_NEAR(dot(to_double(ray.direction), camera.axes.forward), 1, 1e-6);
  }
}

TEST(RayThroughTest, AnOrthographicRayPointsAlongTheViewFromItsPixel) {
  const Camera camera = looking_along_y(Projection::kOrthographic);
  const CameraRay ray = ray_through(camera, {4, 2}, 0, 1);
  EXPECT_EQ(ray.origin, (Vec3f{-0.75f, 0, -0.25f}));
  EXPECT_EQ(ray.direction, (Vec3f{0, 1, 0}));
}

TEST(HalfHeightTest, IsTheTangentOfHalfTheAngle) {
  EXPECT_EQ(half_height_of(90), 1);
  EXPECT_NEAR(half_height_of(60), 1 / std::sqrt(3), 1e-7);
}

TEST(HalfHeightTest, DoesNotDependOnTheLastBitsOfTheLibrarysTangent) {
  for (const double degrees : {30.0, 45.0, 50.0, 60.0, 70.0, 75.0, 90.0}) {
    const double tangent = std::tan(degrees * (std::numbers::pi / 360));
    for (const double other : {tangent * (1 + 4e-16), tangent * (1 - 4e-16)}) {
      EXPECT_EQ(static_cast<float>(other), static_cast<float>(half_height_of(degrees))) << degrees;
    }
  }
}

}  // namespace
}  // namespace locus::cli
