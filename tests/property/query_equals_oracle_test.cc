// Every column of every result equals, bit for bit, the column that a plain loop over all triangles and objects
// computes, and the column that a query returns if RunOptions::brute_force is set.
#include <gtest/gtest.h>

#include "tests/support/placed_scenes.h"
#include "tests/support/query_oracle.h"
#include "tests/support/random_query.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

// Returns the first difference; an empty string if there is none.
std::string oracle_difference(const QueryScene& scene, const SceneSnapshot& snapshot) {
  const QueryBatch batch = batch_of(scene.blocks);
  if (const absl::Status status = check_batch(batch); !status.ok()) return status.ToString();
  RunOptions brute_force;
  brute_force.brute_force = true;
  const auto got = run_batch(snapshot, batch, {});
  const auto brute = run_batch(snapshot, batch, brute_force);
  if (!got.ok() || !brute.ok()) return "a batch was refused";
  if (std::string what = difference(*got, *brute); !what.empty()) return "brute force: " + what;
  const QueryOracle oracle(snapshot);
  for (size_t i = 0; i < batch.blocks.size(); ++i) {
    const std::string what = difference(got->blocks[i], oracle.answer(batch.blocks[i]));
    if (!what.empty()) return "oracle: block " + std::to_string(i) + ", " + what;
  }
  return "";
}

void expect_no_difference(const QueryScene& scene, uint64_t seed) {
  ASSERT_EQ(oracle_difference(scene, *snapshot_of(scene.world)), "") << scene.world.name << ", seed " << seed;
}

template <class Draw>
void expect_no_difference(uint64_t first, uint64_t count, const Draw& draw) {
  for (uint64_t seed = first; seed < first + count; ++seed) {
    Random random(seed);
    expect_no_difference(query_scene(draw(seed, random), random), seed);
  }
}

TEST(QueryEqualsOracleTest, RandomScenesFirstHalf) { expect_no_difference(0, scaled_count(5'000), random_sketch); }

TEST(QueryEqualsOracleTest, RandomScenesSecondHalf) { expect_no_difference(5'000, scaled_count(5'000), random_sketch); }

TEST(QueryEqualsOracleTest, AdversarialScenes) { expect_no_difference(0, scaled_count(1'200), troublesome_sketch); }

TEST(QueryEqualsOracleTest, MeshesFarFromTheWorldsOriginByBoundsAndExactly) {
  for (uint64_t seed = 0; seed < scaled_count(2'000); ++seed) {
    Random random(seed);
    QueryScene scene = far_scene(random);
    std::vector<OwnedBlock> by_bounds = scene.blocks;
    for (OwnedBlock& block : by_bounds) {
      block.settings.precision = Precision::kConservative;
      if (auto* rays = std::get_if<RayColumns>(&block.settings.kind); rays != nullptr)
        rays->mode = random.chance(0.5) ? RayMode::kAll : RayMode::kFirst;
    }
    scene.blocks.insert(scene.blocks.end(), by_bounds.begin(), by_bounds.end());
    expect_no_difference(scene, seed);
  }
}

}  // namespace
}  // namespace locus::test
