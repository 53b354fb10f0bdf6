#include "client/cli/extras/render/ray_image.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "client/lib/result_rows.h"

namespace locus::cli {
namespace {

// Returns an image of three pixels: the first hits an object, the second hits a triangle, the third hits nothing.
RayImage three_pixels() {
  RayImage image({3, 1});
  image.t = {2.5f, 8, INFINITY};
  image.ids = {7, 1, 0};
  image.triangles = {client::kNoTriangle, 12, client::kNoTriangle};
  return image;
}

TEST(RayImageTest, ANewImageHasNoHits) {
  const RayImage image({4, 2});
  EXPECT_EQ(image.t.size(), 8u);
  EXPECT_EQ(image.normals.size(), 8u);
  EXPECT_EQ(image.hits(), 0u);
  EXPECT_TRUE(std::isinf(image.t[7]));
}

TEST(RayImageTest, DistinguishesObjectsInstancesAndMisses) {
  const RayImage image = three_pixels();
  EXPECT_EQ(image.hits(), 2u);
  EXPECT_TRUE(image.hit_object(0));
  EXPECT_TRUE(image.hit(1));
  EXPECT_FALSE(image.hit_object(1));
  EXPECT_FALSE(image.hit(2));
  EXPECT_FALSE(image.hit_object(2));
}

// The expected hashes were computed from the documented bytes with Python's struct.pack and sha256sum.
TEST(RayImageTest, HashesMatchTheDocumentedBytes) {
  EXPECT_EQ(depth_sha256(three_pixels()), "cc134b257578272337ded246e45388511a2ac43191eb8237e2b5f9fcf595a74b");
  EXPECT_EQ(ids_sha256(three_pixels()), "4eb9782aba84a9b1b77a55a148b49ad4f21cef90757e89db4917a31a1bd8ea0c");
}

TEST(RayImageTest, TheDepthsHashChangesWithTheLastBitOfOneDepth) {
  RayImage other = three_pixels();
  other.t[1] = std::nextafter(other.t[1], 0.f);
  EXPECT_NE(depth_sha256(other), depth_sha256(three_pixels()));
  EXPECT_EQ(ids_sha256(other), ids_sha256(three_pixels()));
}

TEST(RayImageTest, TheIdsHashChangesWithOneIdAndWithOneTriangle) {
  RayImage id = three_pixels(), triangle = three_pixels();
  id.ids[0] ^= uint64_t{1} << 63;
  triangle.triangles[1] ^= 1;
  EXPECT_NE(ids_sha256(id), ids_sha256(three_pixels()));
  EXPECT_NE(ids_sha256(triangle), ids_sha256(three_pixels()));
  EXPECT_EQ(depth_sha256(id), depth_sha256(three_pixels()));
}

TEST(RayImageTest, HashesIncludeTheSizeOfTheImage) {
  RayImage tall = three_pixels();
  std::swap(tall.size.width, tall.size.height);
  EXPECT_NE(depth_sha256(tall), depth_sha256(three_pixels()));
  EXPECT_NE(ids_sha256(tall), ids_sha256(three_pixels()));
}

}  // namespace
}  // namespace locus::cli
