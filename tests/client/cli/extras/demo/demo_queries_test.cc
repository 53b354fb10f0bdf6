// Tests that the demo's checks can fail: they accept answers computed by brute force, and detect each kind of wrong
// answer.
#include "client/cli/extras/demo/demo_queries.h"

#include <gtest/gtest.h>

#include <cmath>

#include "client/cli/extras/demo/demo_level.h"
#include "client/cli/levels/generate/city.h"

namespace locus::cli {
namespace {

constexpr uint64_t kSeed = 7;
constexpr uint64_t kTick = 13;
constexpr int kQueries = 40;

// Fixture with a small city, its objects at the tick kTick, and the correct answers to one batch of each kind.
class DemoQueriesTest : public testing::Test {
 protected:
  DemoQueriesTest() : level_(make_level()), world_(level_.bounds, 5000, kSeed), checker_(level_.instances, world_) {
    for (uint32_t i = 0; i < world_.size(); ++i) objects_.push_back({world_.id(i), world_.shape(i, kTick)});
  }

  static DemoLevel make_level() {
    ImportedLevel level;
    level.meshes.push_back(generate_city(600, kSeed));
    level.recentre = {1000, -2000, 0.5};
    return place_level(level);
  }

  v1::QueryResult answer(const v1::QueryBatch& batch) const {
    v1::QueryResult result;
    result.set_tick(kTick);
    v1::BlockResult& block = *result.add_blocks();
    const v1::QueryBlock& asked = batch.blocks(0);
    const BruteForce brute_force(level_.instances, objects_);
    const Vec3d frame{asked.frame().x(), asked.frame().y(), asked.frame().z()};
    for (int i = 0; i < kQueries; ++i) {
      const auto at = [i, &frame](const auto& column) {
        return frame + Vec3d{column[3 * i], column[3 * i + 1], column[3 * i + 2]};
      };
      if (asked.has_rays()) {
        const FirstHit hit = brute_force.first(
            at(asked.rays().origins()),
            {asked.rays().directions(3 * i), asked.rays().directions(3 * i + 1), asked.rays().directions(3 * i + 2)});
        block.add_t(hit.t);
        block.add_ids(hit.id);
        block.add_triangles(hit.triangle);
        if (asked.rays().mode() == v1::RAY_MODE_ANY) block.mutable_hits()->push_back(hit.id != 0 ? '\1' : '\0');
      } else {
        const std::vector<OverlapRow> rows = brute_force.ball({at(asked.balls().centers()), asked.balls().radii(i)});
        block.add_counts(static_cast<uint32_t>(rows.size()));
        for (const OverlapRow& row : rows) {
          block.add_ids(row.id);
          block.add_triangles(row.triangle);
        }
      }
    }
    return result;
  }

  uint64_t differences(DemoKind kind, const v1::QueryBatch& batch, const v1::QueryResult& result) {
    const DemoChecker::Outcome outcome = checker_.check(kind, batch, result, kQueries);
    EXPECT_EQ(outcome.checked, static_cast<uint64_t>(kQueries));
    return outcome.differences;
  }

  DemoLevel level_;
  DemoWorld world_;
  std::vector<CheckedObject> objects_;
  DemoChecker checker_;
};

TEST_F(DemoQueriesTest, CorrectRaysPassAndOneLostHitIsDetected) {
  DemoRandom random(kSeed);
  const v1::QueryBatch batch = demo_batch(DemoKind::kFirst, world_, random, kQueries);
  v1::QueryResult result = answer(batch);
  EXPECT_EQ(differences(DemoKind::kFirst, batch, result), 0u);
  ASSERT_GT(count_found(result.blocks(0)), 0u);
  v1::BlockResult& block = *result.mutable_blocks(0);
  int hit = 0;
  while (block.ids(hit) == 0) ++hit;
  block.set_t(hit, std::nextafter(block.t(hit), 0.0f));
  EXPECT_EQ(differences(DemoKind::kFirst, batch, result), 1u) << "seed " << kSeed;
}

TEST_F(DemoQueriesTest, ALostAnyHitIsDetected) {
  DemoRandom random(kSeed);
  const v1::QueryBatch batch = demo_batch(DemoKind::kAny, world_, random, kQueries);
  v1::QueryResult result = answer(batch);
  EXPECT_EQ(differences(DemoKind::kAny, batch, result), 0u);
  std::string& hits = *result.mutable_blocks(0)->mutable_hits();
  const size_t hit = hits.find('\1');
  ASSERT_NE(hit, std::string::npos);
  hits[hit] = '\0';
  EXPECT_EQ(differences(DemoKind::kAny, batch, result), 1u) << "seed " << kSeed;
}

TEST_F(DemoQueriesTest, ALostOverlapRowIsDetected) {
  DemoRandom random(kSeed);
  const v1::QueryBatch batch = demo_batch(DemoKind::kBalls, world_, random, kQueries);
  v1::QueryResult result = answer(batch);
  EXPECT_EQ(differences(DemoKind::kBalls, batch, result), 0u);
  v1::BlockResult& block = *result.mutable_blocks(0);
  int last = kQueries - 1;
  while (last > 0 && block.counts(last) == 0) --last;
  ASSERT_GT(block.counts(last), 0u);
  block.set_counts(last, block.counts(last) - 1);
  block.mutable_ids()->RemoveLast();
  block.mutable_triangles()->RemoveLast();
  EXPECT_EQ(differences(DemoKind::kBalls, batch, result), 1u) << "seed " << kSeed;
}

TEST_F(DemoQueriesTest, AnswersOfAnotherTickAreDetected) {
  DemoRandom random(kSeed);
  const v1::QueryBatch batch = demo_batch(DemoKind::kFirst, world_, random, kQueries);
  v1::QueryResult result = answer(batch);
  bool object_hit = false;
  for (const uint64_t id : result.blocks(0).ids()) object_hit = object_hit || id >= DemoWorld::kFirstObjectId;
  ASSERT_TRUE(object_hit) << "seed " << kSeed;
  result.set_tick(kTick + 1);
  EXPECT_GT(differences(DemoKind::kFirst, batch, result), 0u) << "seed " << kSeed;
}

}  // namespace
}  // namespace locus::cli
