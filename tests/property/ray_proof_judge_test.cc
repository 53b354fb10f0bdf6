// Tests of the checker of the ray proof: the tree of the checker is compared with a plain list of triangles, and the
// checker must report answers that were corrupted on purpose.
#include <gtest/gtest.h>

#include "tests/support/proof/ray_proof.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

struct Nearest {
  Real t = std::numeric_limits<Real>::infinity();
  uint32_t number = 0xFFFFFFFF;
  friend bool operator==(const Nearest&, const Nearest&) = default;

  void offer(uint32_t candidate, const Meeting& meeting) {
    if (meeting.inset < 0) return;
    if (meeting.t < t || (meeting.t == t && candidate < number)) *this = {meeting.t, candidate};
  }
};

Nearest by_tree(const ReferenceTree& reference, const RealRay& ray) {
  Nearest nearest;
  reference.visit(ray, nearest.t, [&](uint32_t number, const Meeting& meeting) { nearest.offer(number, meeting); });
  return nearest;
}

Nearest by_list(const ReferenceTree& reference, const RealRay& ray) {
  Nearest nearest;
  for (uint32_t index = 0; index < reference.size(); ++index)
    if (const std::optional<Meeting> meeting = reference.triangle(index).meet(ray, nearest.t))
      nearest.offer(index, *meeting);
  return nearest;
}

TEST(RayProofJudgeTest, TheTreeOfTheReferenceFindsWhatItsListFinds) {
  constexpr uint64_t kSeed = 11;
  Random random(kSeed);
  uint64_t hits = 0;
  const std::vector<Triangle> city = box_city(5, kSeed), sphere = bumpy_sphere(8, 0.1, kSeed);
  const std::shared_ptr<const ProofMesh> meshes[] = {
      proof_mesh(city, 0.5), proof_mesh(internal::moved(city, 1, {65'536, -131'072, 32'768}), 0.5),
      proof_mesh(internal::moved(sphere, 1e-3, {})), proof_mesh(internal::slivers(200, kSeed)),
      proof_mesh(internal::soup(200, kSeed))};
  for (uint64_t i = 0; i < scaled_count(100'000); ++i) {
    const ProofMesh& mesh = *meshes[i % std::size(meshes)];
    const internal::MeshRay aim = random.pick(internal::kRayFamilies)(mesh, random);
    const Vec3r origin = to_real(aim.origin);
    const RealRay ray = {origin, (to_real(aim.target) - origin) * random.magnitude(-20, 20)};
    const Nearest expected = by_list(mesh.reference, ray);
    ASSERT_EQ(by_tree(mesh.reference, ray), expected) << "seed " << kSeed << ", ray " << i;
    hits += expected.number != 0xFFFFFFFF;
  }
  EXPECT_GT(hits, scaled_count(100'000) / 3);
}

class CorruptedAnswersTest : public ::testing::Test {
 protected:
  CorruptedAnswersTest() : scene_(proof_scenes(12)[6]), random_(12), block_(proof_rays(scene_, 4'000, random_)) {
    answer_ = run_block(*scene_.snapshot, block_);
  }
  // Calls `corrupt` with a copy of the answers and the index of each hit, and returns the checker's tally of the copy.
  template <class Corrupt>
  RayTally check_corrupted(Corrupt corrupt) {
    BlockResult corrupted = answer_;
    for (size_t i = 0; i < corrupted.t.size(); ++i)
      if (corrupted.ids[i] != kNoId) corrupt(corrupted, i);
    return judge_first_hits(scene_, block_, corrupted);
  }
  // Returns nine tenths of the number of hits in the answers.
  uint64_t most_hits() { return judge_first_hits(scene_, block_, answer_).hits * 9 / 10; }

  ProofScene scene_;
  Random random_;
  OwnedBlock block_;
  BlockResult answer_;
};

TEST_F(CorruptedAnswersTest, UnchangedAnswersHaveNoFaults) {
  const RayTally tally = judge_first_hits(scene_, block_, answer_);
  EXPECT_TRUE(tally.clean()) << absl::StrJoin(tally.faults, "\n");
  EXPECT_GT(tally.hits, tally.rays / 2);
}

TEST_F(CorruptedAnswersTest, ALostHitIsAMiss) {
  const RayTally tally = check_corrupted([](BlockResult& result, size_t i) {
    result.t[i] = std::numeric_limits<float>::infinity();
    result.ids[i] = kNoId;
  });
  EXPECT_GT(tally.misses, most_hits());
}

TEST_F(CorruptedAnswersTest, AHitInFrontOfItsTriangleIsFalseAndAHitBehindItIsAMiss) {
  const auto move = [](float factor) { return [factor](BlockResult& result, size_t i) { result.t[i] *= factor; }; };
  // Not all hits become false, since multiplication does not change a hit at t = 0.
  EXPECT_GT(check_corrupted(move(0.99f)).false_hits, most_hits() * 8 / 10);
  EXPECT_GT(check_corrupted(move(1.01f)).misses, most_hits() / 2);
}

TEST_F(CorruptedAnswersTest, AHitOfAnotherTriangleOrInstanceIsFalse) {
  EXPECT_GT(check_corrupted([](BlockResult& result, size_t i) { result.triangles[i] ^= 16; }).false_hits, most_hits());
  EXPECT_GT(check_corrupted([](BlockResult& result, size_t i) { result.ids[i] = 4 - result.ids[i]; }).false_hits,
            most_hits() / 2);
}

TEST_F(CorruptedAnswersTest, AHitBeyondTheLimitIsFalse) {
  block_.extras.assign(block_.extras.size(), 0.0f);
  EXPECT_GT(check_corrupted([](BlockResult&, size_t) {}).false_hits, most_hits() * 8 / 10);
}

// The answers are computed without culling, but the checker expects answers in which front sides are culled.
TEST_F(CorruptedAnswersTest, AHitOfTheCulledSideIsFalse) {
  rays_of(block_).cull = Cull::kNone;
  block_.extras.assign(block_.extras.size(), std::numeric_limits<float>::infinity());
  answer_ = run_block(*scene_.snapshot, block_);
  rays_of(block_).cull = Cull::kFront;
  EXPECT_GT(check_corrupted([](BlockResult&, size_t) {}).false_hits, most_hits() / 4);
}

TEST_F(CorruptedAnswersTest, AHitMissingFromAllIsAMiss) {
  rays_of(block_).mode = RayMode::kAll;
  BlockResult all = run_block(*scene_.snapshot, block_);
  EXPECT_TRUE(judge_all_hits(scene_, block_, all).clean());
  EXPECT_GT(all.t.size(), all.counts.size());
  // Copies the first row of each ray to its last row, so that the triangle of the last row is missing.
  uint64_t corrupted = 0;
  for (size_t i = 0, row = 0; i < all.counts.size(); row += all.counts[i++]) {
    if (all.counts[i] < 2) continue;
    const size_t last = row + all.counts[i] - 1;
    all.t[last] = all.t[row];
    all.ids[last] = all.ids[row];
    all.triangles[last] = all.triangles[row];
    ++corrupted;
  }
  const RayTally tally = judge_all_hits(scene_, block_, all);
  EXPECT_EQ(tally.false_hits, 0u);
  EXPECT_GT(tally.misses, corrupted * 8 / 10);
}

TEST_F(CorruptedAnswersTest, AFartherHitThanTheNearestIsAMiss) {
  rays_of(block_).mode = RayMode::kAll;
  const BlockResult all = run_block(*scene_.snapshot, block_);
  uint64_t corrupted = 0;
  for (size_t i = 0, row = 0; i < all.counts.size(); row += all.counts[i++]) {
    if (all.counts[i] < 2) continue;
    const size_t last = row + all.counts[i] - 1;
    answer_.t[i] = all.t[last];
    answer_.ids[i] = all.ids[last];
    answer_.triangles[i] = all.triangles[last];
    corrupted += all.t[last] > all.t[row] * 1.1f;
  }
  const RayTally tally = judge_first_hits(scene_, block_, answer_);
  EXPECT_EQ(tally.false_hits, 0u);
  EXPECT_GT(tally.misses, corrupted * 8 / 10);
  EXPECT_GT(corrupted, tally.rays / 10);
}

}  // namespace
}  // namespace locus::test
