// No ray leaves a closed mesh. Each run aims tens of thousands of rays from inside at corners and edges; the long run
// aims a million rays for each scale and distance.
#include "tests/support/proof/leak_proof.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

constexpr uint64_t kLeakSeed = 4;

void expect_no_leak(int finer, uint64_t rays_of_each) {
  const LeakProof proof(kLeakSeed, meshes_with_an_inside(finer, kLeakSeed));
  LeakTally sum;
  int families = 0;
  for (const double scale : {1e-3, 1.0, 1e3}) {
    for (const double distance : {0.0, 1e3, 1e6}) {
      const LeakTally tally = proof.run(scale, distance, rays_of_each);
      EXPECT_EQ(tally.leaks, 0u) << "scale " << scale << ", distance " << distance << ", seed " << kLeakSeed << "\n"
                                 << absl::StrJoin(tally.first_leaks, "\n");
      EXPECT_GE(tally.rays, rays_of_each);
      sum.add(tally);
      std::fprintf(stderr, "scale %g, distance %g: %llu rays, %llu leaks\n", scale, distance,
                   static_cast<unsigned long long>(tally.rays), static_cast<unsigned long long>(tally.leaks));
      ++families;
    }
  }
  std::printf(
      "proof: %d scales and distances, %llu rays at corners and edges from inside, each as first, any and all "
      "hits by %s: %llu leaks; seed %llu\n",
      families, static_cast<unsigned long long>(sum.rays), absl::StrJoin(instruction_sets(), ", ").c_str(),
      static_cast<unsigned long long>(sum.leaks), static_cast<unsigned long long>(kLeakSeed));
}

TEST(LeakProofTest, NoRayLeavesAClosedMesh) { expect_no_leak(0, scaled_count(8'000)); }

TEST(LongLeakProofTest, NoRayLeavesAClosedMesh) { expect_no_leak(1, 1'000'000); }

// Verifies the preconditions of the proof: the triangles use each edge equally often in both directions, and the middle
// of each edge is outside the ball in which rays start.
TEST(LeakProofTest, ItsMeshesAreClosedAroundTheirInside) {
  for (const ClosedMesh& mesh :
       {icosphere(3, 0.1, 0, kLeakSeed), icosphere(3, 0.02, 0x1p-12, kLeakSeed), small_blob(5'000, kLeakSeed)}) {
    std::map<std::array<float, 6>, int> edges;
    for (const Triangle& triangle : mesh.triangles) {
      const Vec3f corners[] = {triangle.a, triangle.b, triangle.c};
      for (int i = 0; i < 3; ++i) {
        const Vec3f a = corners[i], b = corners[(i + 1) % 3];
        ++edges[{a.x, a.y, a.z, b.x, b.y, b.z}];
        --edges[{b.x, b.y, b.z, a.x, a.y, a.z}];
        EXPECT_GT(squared_length(to_double(a) + to_double(b)) / 4, mesh.inner_radius * mesh.inner_radius);
      }
    }
    for (const auto& [edge, balance] : edges) ASSERT_EQ(balance, 0);
  }
}

// Verifies that the proof reports rays that leave a mesh from which five triangles were removed.
TEST(LeakProofTest, AHoleIsFound) {
  ClosedMesh sphere = icosphere(3, 0.01, 0, kLeakSeed);
  sphere.triangles.resize(sphere.triangles.size() - 5);
  EXPECT_GT(LeakProof(kLeakSeed, {sphere}).run(1, 1e3, 4'000).leaks, 0u);
}

}  // namespace
}  // namespace locus::test
