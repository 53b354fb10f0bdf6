#include "client/cli/extras/render/paint.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "client/cli/extras/render/colours.h"
#include "client/lib/result_rows.h"

namespace locus::cli {
namespace {

int brightness(Colour colour) { return colour.red + colour.green + colour.blue; }
int spread(Colour colour) {
  return std::max({colour.red, colour.green, colour.blue}) - std::min({colour.red, colour.green, colour.blue});
}

Camera looking_along_y() { return {.eye = {}, .axes = *view_axes({0, 1, 0}, {0, 0, 1}), .half_height = 0.1}; }

// Returns an image of which every pixel hits the front of the object or instance `id`.
RayImage wall(const ImageSize& size, uint64_t id, uint32_t triangle) {
  RayImage image(size);
  for (size_t pixel = 0; pixel < size.pixels(); ++pixel) {
    image.t[pixel] = 5;
    image.ids[pixel] = id;
    image.triangles[pixel] = triangle;
    image.normals[pixel] = {0, -1, 0};
  }
  return image;
}

TEST(ScaleTest, HoldsMinimumMaximumMedianAndNinetyNinthPercentile) {
  std::vector<double> values;
  for (int i = 100; i >= 0; --i) values.push_back(i);
  values.back() = 0;
  const ValueScale scale = scale_of(values);
  EXPECT_EQ(scale.min, 0);
  EXPECT_EQ(scale.median, 50);
  EXPECT_EQ(scale.high, 99);
  EXPECT_EQ(scale.max, 100);
}

TEST(ScaleTest, OfNoValuesIsZero) { EXPECT_EQ(scale_of({}).max, 0); }

TEST(ScaleTest, DepthsHoldHitsOnly) {
  RayImage image = wall({2, 1}, 3, 0);
  image.ids[0] = 0;
  EXPECT_EQ(depths_of(image), std::vector<double>{5});
}

TEST(ShadedTest, ObjectsAreColouredAndInstancesPale) {
  const Camera camera = looking_along_y();
  const Colour object = paint_shaded(wall({3, 3}, 6, client::kNoTriangle), camera).pixels[4];
  const Colour instance = paint_shaded(wall({3, 3}, 6, 0), camera).pixels[4];
  EXPECT_GT(spread(object), 60);
  EXPECT_LT(spread(instance), 30);
}

TEST(ShadedTest, SurfacesFacingTheLampAreBrighterThanThoseFacingAway) {
  const Camera camera = looking_along_y();
  RayImage image = wall({2, 1}, 3, 0);
  image.normals = {{-0.5f, -0.5f, 0.7f}, {0.5f, -0.5f, -0.7f}};
  image.ids[1] = 3;
  const Picture picture = paint_shaded(image, camera);
  EXPECT_GT(brightness(picture.pixels[0]), 2 * brightness(picture.pixels[1]));
}

TEST(ShadedTest, TheBackOfATriangleIsLitAsItsFrontWouldBe) {
  const Camera camera = looking_along_y();
  RayImage back = wall({1, 1}, 3, 0);
  back.normals[0] = {0, 1, 0};
  EXPECT_EQ(paint_shaded(back, camera).pixels, paint_shaded(wall({1, 1}, 3, 0), camera).pixels);
}

TEST(ShadedTest, TheNearerOfTwoThingsHasADarkEdge) {
  const Camera camera = looking_along_y();
  RayImage image = wall({4, 1}, 3, 0);
  image.ids[2] = image.ids[3] = 4;
  image.t[2] = image.t[3] = 6;
  const Picture picture = paint_shaded(image, camera);
  EXPECT_LT(2 * brightness(picture.pixels[1]), 2 * brightness(picture.pixels[0]) - 100);
  EXPECT_NEAR(brightness(picture.pixels[2]), brightness(picture.pixels[3]), 12);
}

TEST(ShadedTest, AMissShowsADarkBackground) {
  const Picture picture = paint_shaded(RayImage({2, 2}), looking_along_y());
  for (const Colour colour : picture.pixels) EXPECT_LT(brightness(colour), 250);
}

TEST(DepthTest, NearIsBrightFarIsDarkAndAMissIsBlack) {
  RayImage image = wall({3, 1}, 3, 0);
  image.t = {2, 10, 5};
  image.ids[2] = 0;
  const Picture picture = paint_depth(image, scale_of(depths_of(image)));
  EXPECT_EQ(picture.pixels[0], viridis(1));
  EXPECT_EQ(picture.pixels[1], viridis(0));
  EXPECT_EQ(picture.pixels[2], Colour{});
}

TEST(DepthTest, ASingleDepthHasAColour) {
  const RayImage image = wall({1, 1}, 3, 0);
  EXPECT_EQ(paint_depth(image, scale_of(depths_of(image))).pixels[0], viridis(0));
}

TEST(NormalsTest, ComponentsAreColours) {
  RayImage image = wall({2, 1}, 3, 0);
  image.normals[0] = {1, -1, 0};
  image.ids[1] = 0;
  const Picture picture = paint_normals(image);
  EXPECT_EQ(picture.pixels[0], (Colour{255, 0, 127}));
  EXPECT_EQ(picture.pixels[1], (Colour{24, 24, 24}));
}

TEST(IdsTest, EachIdHasAColourOfItsOwn) {
  RayImage image = wall({4, 1}, 3, client::kNoTriangle);
  image.ids = {3, 4, 3, 0};
  const Picture picture = paint_ids(image);
  EXPECT_EQ(picture.pixels[0], picture.pixels[2]);
  EXPECT_NE(picture.pixels[0], picture.pixels[1]);
  EXPECT_EQ(picture.pixels[3], Colour{});
}

TEST(IdsTest, AnInstanceIsDarkerThanAnObjectOfItsHue) {
  const Colour object = paint_ids(wall({1, 1}, 3, client::kNoTriangle)).pixels[0];
  const Colour instance = paint_ids(wall({1, 1}, 3, 0)).pixels[0];
  EXPECT_GT(brightness(object), brightness(instance));
}

TEST(HeatTest, GoesFromTheCheapestToTheNinetyNinthPercentile) {
  const std::vector<double> values = {10, 20, 30, 500};
  const Picture picture = paint_heat({4, 1}, values, {.min = 10, .median = 20, .high = 30, .max = 500});
  EXPECT_EQ(picture.pixels[0], inferno(0));
  EXPECT_EQ(picture.pixels[1], inferno(0.5));
  EXPECT_EQ(picture.pixels[2], inferno(1));
  EXPECT_EQ(picture.pixels[3], inferno(1));
}

TEST(ReducedTest, PixelsAreAveragedByTheirLight) {
  const Picture picture = {{4, 2},
                           {{0, 0, 0},
                            {255, 255, 255},
                            {9, 9, 9},
                            {9, 9, 9},  //
                            {255, 255, 255},
                            {0, 0, 0},
                            {9, 9, 9},
                            {9, 9, 9}}};
  const Picture half = reduced(picture, 2);
  EXPECT_EQ(half.size, (ImageSize{2, 1}));
  EXPECT_EQ(half.pixels[0], (Colour{180, 180, 180}));
  EXPECT_EQ(half.pixels[1], (Colour{9, 9, 9}));
}

TEST(ReducedTest, ByOneIsThePictureItself) {
  const Picture picture = {{2, 1}, {{1, 2, 3}, {200, 100, 50}}};
  EXPECT_EQ(reduced(picture, 1).pixels, picture.pixels);
}

}  // namespace
}  // namespace locus::cli
