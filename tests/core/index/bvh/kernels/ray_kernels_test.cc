// Tests of the ray kernels of every instruction set: their results equal, bit for bit, those of testing all triangles
// one by one.
#include "core/index/bvh/kernels/ray_kernels.h"

#include <gtest/gtest.h>
#ifdef __SSE__
#include <xmmintrin.h>
#endif

#include <string>
#include <vector>

#include "core/index/bvh/kernels/dispatch.h"
#include "tests/support/kernel_trials.h"
#include "tests/support/vector_sets.h"

namespace locus::test {
namespace {

Triangle wall_at(float x, uint32_t number) { return {{x, -1, -1}, {x, 1, -1}, {x, -1, 1}, number}; }

class RayKernelsTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    ASSERT_TRUE(use_instruction_set(GetParam()).ok());
    kernels_ = active_ray_kernels();
    ASSERT_NE(kernels_, nullptr);
  }
  void TearDown() override { ASSERT_TRUE(use_instruction_set("").ok()); }

  const RayKernels* kernels_ = nullptr;
};

TEST_P(RayKernelsTest, AnswerRandomRaysInMeshesOfAnySizeAsAllTrianglesDo) {
  for (const KernelTrial& trial : ordinary_trials()) {
    EXPECT_EQ(trial.difference(*kernels_), "");
    EXPECT_LT(trial.undecided_share(*kernels_), 0.001);
  }
}

TEST_P(RayKernelsTest, AnswerRaysInFarMeshesAsAllTrianglesDo) {
  for (const KernelTrial& trial : far_trials()) EXPECT_EQ(trial.difference(*kernels_), "");
}

TEST_P(RayKernelsTest, AnswerCoherentRaysAsAllTrianglesDo) {
  for (const KernelTrial& trial : beam_trials()) EXPECT_EQ(trial.difference(*kernels_), "");
}

TEST_P(RayKernelsTest, AnswerFansOfRaysFromOnePointAsAllTrianglesDo) {
  for (const KernelTrial& trial : fan_trials()) EXPECT_EQ(trial.difference(*kernels_), "");
}

#ifdef __SSE__
// Some libraries set the processor flags that treat denormals as zero; the flags apply to all later code of the thread.
TEST_P(RayKernelsTest, AnswersDoNotChangeIfDenormalsAreTreatedAsZero) {
  const TriangleBvh tree = *TriangleBvh::build(bumpy_sphere(14, 0.1, 1));
  std::vector<KernelRay> rays;
  for (int i = 0; i < 8; ++i)  // nearly equal directions in different octants
    rays.push_back({{0, 0, 0}, {1, i % 2 == 0 ? 0.01 : -0.01, i % 4 < 2 ? 0.01 : -0.01}, 10, true, true});
  const auto numbers = [&] {
    std::vector<KernelHit> hits(rays.size());
    kernels_->first(tree.tree(), rays.data(), hits.data(), rays.size());
    std::vector<uint32_t> result;
    for (const KernelHit& hit : hits) result.push_back(hit.number);
    return result;
  };
  const std::vector<uint32_t> expected = numbers();
  const unsigned int usual = _mm_getcsr();
  _mm_setcsr(usual | 0x8040);  // sets the flags FTZ (flush to zero) and DAZ (denormals are zero)
  const std::vector<uint32_t> found = numbers();
  _mm_setcsr(usual);
  EXPECT_EQ(found, expected);
}
#endif

TEST_P(RayKernelsTest, CoherentRaysOpenEachNodeOnce) {
  const TriangleBvh tree = *TriangleBvh::build(bumpy_sphere(14, 0.1, 1));
  std::vector<KernelRay> rays;
  for (int i = 0; i < 8; ++i) rays.push_back({{0, 0, 0}, {1, 0.2 + 0.001 * i, 0.3}, 10, true, true});
  const auto nodes = [&](size_t at_once) {
    uint32_t sum = 0;
    for (size_t first = 0; first < rays.size(); first += at_once) {
      std::vector<KernelHit> hits(at_once);
      kernels_->first(tree.tree(), &rays[first], hits.data(), at_once);
      for (const KernelHit& hit : hits) sum += hit.nodes;
    }
    return sum;
  };
  EXPECT_LT(nodes(8) * 4, nodes(1));
}

// Sixteen rays from one point are tested with few triangles, because one test with a frustum excludes all others.
TEST_P(RayKernelsTest, RaysFromOnePointOpenEachNodeOnceAndSkipTrianglesBesideThem) {
  const TriangleBvh tree = *TriangleBvh::build(bumpy_sphere(40, 0.1, 1));
  std::vector<KernelRay> rays;
  for (int i = 0; i < 16; ++i) rays.push_back({{0, 0, 0}, {1, 0.2 + 0.001 * i, 0.3}, 10, true, true});
  std::vector<KernelHit> together(16), alone(16);
  kernels_->first(tree.tree(), rays.data(), together.data(), 16);
  uint32_t nodes_together = 0, nodes_alone = 0, tests_together = 0, tests_alone = 0;
  for (size_t i = 0; i < 16; ++i) {
    kernels_->first(tree.tree(), &rays[i], &alone[i], 1);
    EXPECT_EQ(together[i].t, alone[i].t);
    EXPECT_EQ(together[i].number, alone[i].number);
    nodes_together += together[i].nodes;
    nodes_alone += alone[i].nodes;
    tests_together += together[i].tests;
    tests_alone += alone[i].tests;
  }
  EXPECT_LT(nodes_together * 8, nodes_alone);
  EXPECT_LT(tests_together * 2, tests_alone);
}

// Fifteen rays of the fan pass beside all triangles of a pile, within their boxes. So the beam gives up, and its rays
// are traced alone: one of them hits a triangle, the others stay undecided.
TEST_P(RayKernelsTest, ABeamThatTestsTooManyTrianglesIsTracedRayByRay) {
  std::vector<Triangle> pile;
  for (uint32_t i = 0; i < 3 * kMaxKernelTests; ++i) pile.push_back(wall_at(static_cast<float>(i), i));
  const absl::StatusOr<TriangleBvh> tree = TriangleBvh::build(pile);
  ASSERT_TRUE(tree.ok());
  std::vector<KernelRay> rays(16, kernel_ray({{-1, 0.9, 0.9}, {1, -1e-6, -1e-6}}));
  rays[3].direction[1] = rays[3].direction[2] = -0.1;
  std::vector<KernelHit> hits(16);
  kernels_->first(tree->tree(), rays.data(), hits.data(), 16);
  for (size_t i = 0; i < 16; ++i)
    EXPECT_EQ(hits[i].verdict, i == 3 ? KernelVerdict::kHit : KernelVerdict::kUndecided) << i;
}

TEST_P(RayKernelsTest, AnswerRaysOnALatticeAsAllTrianglesDo) { EXPECT_EQ(lattice_trial().difference(*kernels_), ""); }

TEST_P(RayKernelsTest, AnswerNearlyDiagonalRaysAsAllTrianglesDo) {
  EXPECT_EQ(near_diagonal_trial().difference(*kernels_), "");
}

TEST_P(RayKernelsTest, AnswerRaysAimedAtVerticesAndEdgesAsAllTrianglesDo) {
  const KernelTrial trial = border_trial();
  EXPECT_EQ(trial.difference(*kernels_), "");
  EXPECT_LT(trial.undecided_share(*kernels_), 0.001);
}

TEST_P(RayKernelsTest, AnswerRaysFromTheSurfaceAsAllTrianglesDo) {
  EXPECT_EQ(surface_trial().difference(*kernels_), "");
}

TEST_P(RayKernelsTest, AnswerSliversAndTrianglesWithoutAreaAsAllTrianglesDo) {
  EXPECT_EQ(sliver_trial().difference(*kernels_), "");
}

TEST_P(RayKernelsTest, OfEqualHitsTheLowestNumberWins) { EXPECT_EQ(copies_trial().difference(*kernels_), ""); }

// When max_rows hits have been found, triangles behind these hits must not be tested.
TEST_P(RayKernelsTest, FullRowsShortenTheRay) {
  std::vector<Triangle> walls;
  for (uint32_t i = 0; i < 1'000; ++i) walls.push_back(wall_at(static_cast<float>(i), i));
  const TriangleBvh tree = *TriangleBvh::build(walls);
  const KernelRay ray = kernel_ray({{-1, -0.5, -0.5}, {1, 0, 0}});
  KernelHit hit{};
  std::vector<KernelRow> rows(20);
  kernels_->all(tree.tree(), &ray, &hit, 1, rows.data(), 20);
  EXPECT_EQ(hit.number, 20u);
  EXPECT_LT(hit.tests, 60u);
}

// The ray hits the boxes of all triangles of a pile but misses each triangle. So the kernel tests more than
// kMaxKernelTests triangles and leaves the ray undecided.
TEST_P(RayKernelsTest, ARayThatTestsTooManyTrianglesIsLeftUndecided) {
  std::vector<Triangle> pile;
  for (uint32_t i = 0; i < 3 * kMaxKernelTests; ++i) pile.push_back(wall_at(static_cast<float>(i), i));
  const absl::StatusOr<TriangleBvh> tree = TriangleBvh::build(pile);
  ASSERT_TRUE(tree.ok());
  const KernelRay ray = kernel_ray({{-1, 0.9, 0.9}, {1, 0, 0}});
  KernelHit first{}, all{};
  KernelRow row{};
  kernels_->first(tree->tree(), &ray, &first, 1);
  kernels_->all(tree->tree(), &ray, &all, 1, &row, 1);
  for (const KernelHit& hit : {first, all}) {
    EXPECT_EQ(hit.verdict, KernelVerdict::kUndecided);
    EXPECT_GT(hit.tests, kMaxKernelTests);
    EXPECT_LT(hit.tests, kMaxKernelTests + 9);
  }
}

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(RayKernelsTest);
INSTANTIATE_TEST_SUITE_P(InstructionSets, RayKernelsTest, ::testing::ValuesIn(sets_with_vector_kernels()),
                         [](const auto& instance) { return instance.param; });

}  // namespace
}  // namespace locus::test
