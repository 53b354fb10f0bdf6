#include "tests/bench/static/workload.h"

#include <gtest/gtest.h>

#include "tests/bench/static/two_sheets.h"

// Tests of the pseudo-random queries of the workload. An independent program computed the expected values from the
// definition in workload.h.
namespace locus::bench {
namespace {

void expect_near(Vec3f value, Vec3f expected) {
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(value[axis], expected[axis], 1e-6) << axis;
}

TEST(WorkloadTest, IncoherentRaysAreTheKnownOnes) {
  const std::vector<RayQuery> rays = random_rays(two_sheets(), 3, 101, kEndless);
  expect_near(rays[0].origin, {3.26576471f, 0.0687654018f, 0.80595696f});
  expect_near(rays[0].direction, {0.633684099f, -0.765851438f, -0.109160781f});
  expect_near(rays[1].origin, {0.739093065f, 3.88041377f, 0.4085657f});
  expect_near(rays[1].direction, {0.460883439f, 0.677809179f, 0.572853625f});
  expect_near(rays[2].origin, {0.778958082f, 3.50968456f, 2.70959997f});
  expect_near(rays[2].direction, {0.220125735f, -0.904570639f, 0.365098119f});
  EXPECT_EQ(rays[2].t_max, 1e30f);
}

TEST(WorkloadTest, ShortRaysAreTheKnownOnes) {
  const BenchMesh mesh = two_sheets();
  EXPECT_NEAR(mesh.diagonal, 6.40312433f, 1e-6);
  const std::vector<RayQuery> rays = random_rays(mesh, 2, 202, 0.05f * mesh.diagonal);
  expect_near(rays[1].origin, {1.16659498f, 0.979268074f, 0.141037524f});
  expect_near(rays[1].direction, {0.500620723f, 0.0812115669f, -0.86184895f});
  EXPECT_NEAR(rays[1].t_max, 0.320156217f, 1e-7);
}

TEST(WorkloadTest, ThePictureHasTilesOfFourByFour) {
  const std::vector<RayQuery> rays = camera_rays(two_sheets(), 8, 8);
  ASSERT_EQ(rays.size(), 64u);
  expect_near(rays[0].origin, {4.88414717f, 4.16311026f, 4.67256212f});
  expect_near(rays[0].direction, {-0.888759017f, -0.0746128261f, -0.452261299f});
  expect_near(rays[5].direction, {-0.836277485f, -0.175872058f, -0.519335091f});
  expect_near(rays[17].direction, {-0.543648899f, -0.078734383f, -0.835611582f});
}

TEST(WorkloadTest, BallsAreAlternatelyOnTheSurfaceAndAnywhere) {
  const std::vector<Ballf> drawn = balls(two_sheets(), 3, 301, 0.005f);
  expect_near(drawn[0].center, {1.12074053f, 0.160431579f, 0});
  expect_near(drawn[1].center, {2.65813136f, 1.09687781f, 1.76872826f});
  expect_near(drawn[2].center, {2.90551162f, 0.18841134f, 2.95289707f});
  EXPECT_NEAR(drawn[2].radius, 0.0320156217f, 1e-8);
}

TEST(WorkloadTest, BoxesHaveTheKnownBounds) {
  const std::vector<Obbf> drawn = boxes(two_sheets(), 2, 401, 0.005f);
  expect_near(drawn[0].center - drawn[0].half, {0.248744369f, 2.79447031f, -0.045318149f});
  expect_near(drawn[0].center + drawn[0].half, {0.302234113f, 2.84807539f, 0.045318149f});
  expect_near(drawn[1].center - drawn[1].half, {1.91392016f, 0.864820838f, 1.28184235f});
  expect_near(drawn[1].center + drawn[1].half, {2.00704837f, 0.957039475f, 1.32395113f});
}

}  // namespace
}  // namespace locus::bench
