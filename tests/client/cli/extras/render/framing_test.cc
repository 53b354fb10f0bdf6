#include "client/cli/extras/render/framing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace locus::cli {
namespace {

// Position of a box in a picture. `left`, `right`, `down` and `up` are the distances from the picture's centre to the
// box's sides, in units of the distance to the picture's edge. `nearest` is the depth of the box's nearest corner.
struct Shown {
  double left = 0, right = 0, down = 0, up = 0;
  double nearest = HUGE_VAL;

  double widest() const { return std::max({left, right, down, up}); }
};

Shown show(const Camera& camera, const Aabbd& box, double aspect) {
  Shown shown;
  for (unsigned i = 0; i < 8; ++i) {
    const Vec3d corner = {i & 1 ? box.max.x : box.min.x, i & 2 ? box.max.y : box.min.y, i & 4 ? box.max.z : box.min.z};
    const Vec3d from_eye = corner - camera.eye;
    const double depth = dot(from_eye, camera.axes.forward);
    const double half = camera.projection == Projection::kPerspective ? camera.half_height * depth : camera.half_height;
    const double x = dot(from_eye, camera.axes.right) / (half * aspect), y = dot(from_eye, camera.axes.up) / half;
    shown.left = std::max(shown.left, -x);
    shown.right = std::max(shown.right, x);
    shown.down = std::max(shown.down, -y);
    shown.up = std::max(shown.up, y);
    shown.nearest = std::min(shown.nearest, depth);
  }
  return shown;
}

const Aabbd kLongBox = {{-30, 5, 0}, {50, 12, 9}};
const Aabbd kFarBox = {{4e8, -7e8, 1e3}, {4e8 + 3, -7e8 + 3, 1e3 + 3}};
const Vec3d kUps[] = {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}, {0, 0, -2}, {0.3, -0.9, 0.2}};

TEST(ThreeQuarterViewTest, LooksObliquelyDownForEveryUp) {
  for (const Vec3d up : kUps) {
    const Vec3d view = three_quarter_view(up);
    EXPECT_NEAR(squared_length(view), 1, 1e-12);
    const double down = -dot(view, normalized(up));
    EXPECT_GT(down, 0.4);
    EXPECT_LT(down, 0.8);
  }
  EXPECT_GT(three_quarter_view({0, 0, 1}).x, 0.3);
  EXPECT_GT(three_quarter_view({0, 0, 1}).y, 0.3);
}

TEST(FrameBoxTest, AllOfTheBoxIsInThePictureAndFillsItInOneDirection) {
  for (const Aabbd& box : {kLongBox, kFarBox}) {
    for (const Vec3d up : kUps) {
      for (const double aspect : {16.0 / 9, 1.0, 0.25}) {
        const Lens lens = {.half_height = 0.4, .aspect = aspect, .margin = 1};
        const Shown shown = show(frame_box(box, *view_axes(three_quarter_view(up), up), lens), box, aspect);
        EXPECT_NEAR(shown.widest(), 1, 1e-6);
        EXPECT_GT(shown.nearest, 0);
      }
    }
  }
}

TEST(FrameBoxTest, TheBoxIsCentredInTheDirectionItFills) {
  const Lens lens = {.half_height = 0.4, .aspect = 0.25, .margin = 1};
  const Shown shown = show(frame_box(kLongBox, *view_axes({1, 2, -1}, {0, 0, 1}), lens), kLongBox, lens.aspect);
  EXPECT_NEAR(shown.left, shown.right, 1e-9);
}

TEST(FrameBoxTest, AMarginOfTwoShowsTheBoxAboutHalfAsLarge) {
  const Lens lens = {.half_height = 0.01, .aspect = 1, .margin = 2};  // nearly without perspective
  const Shown shown = show(frame_box(kLongBox, *view_axes({1, 2, -1}, {0, 0, 1}), lens), kLongBox, 1);
  EXPECT_NEAR(shown.widest(), 0.5, 0.02);
}

TEST(FrameBoxTest, TheOrthographicHeightFitsTheBox) {
  for (const double aspect : {16.0 / 9, 0.25}) {
    const Lens lens = {.projection = Projection::kOrthographic, .half_height = 0, .aspect = aspect, .margin = 1};
    const Shown shown = show(frame_box(kLongBox, *view_axes({1, 2, -1}, {0, 0, 1}), lens), kLongBox, aspect);
    EXPECT_NEAR(shown.widest(), 1, 1e-9);
    EXPECT_GT(shown.nearest, 0);
  }
}

TEST(FrameBoxTest, AGivenOrthographicHeightIsKept) {
  const Lens lens = {.projection = Projection::kOrthographic, .half_height = 12};
  EXPECT_EQ(frame_box(kLongBox, *view_axes({0, 1, 0}, {0, 0, 1}), lens).half_height, 12);
}

TEST(FrameBoxTest, ASinglePointIsSeenFromADistance) {
  const Aabbd point = {{5, 5, 5}, {5, 5, 5}};
  const Camera camera = frame_box(point, *view_axes({0, 1, 0}, {0, 0, 1}), Lens{.half_height = 1});
  EXPECT_NEAR(camera.eye.x, 5, 1e-9);
  EXPECT_LT(camera.eye.y, 4);
}

}  // namespace
}  // namespace locus::cli
