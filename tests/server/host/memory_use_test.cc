#include "server/host/memory_use.h"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <vector>

namespace locus::server {
namespace {

constexpr std::array<uint64_t, 4> kIds = {1, 2, 3, 4};
constexpr std::chrono::steady_clock::time_point kNow = std::chrono::steady_clock::time_point::min();

UpdateBatch moving() {
  UpdateBatch batch;
  batch.moves.emplace_back().ids = kIds;
  return batch;
}

TEST(MemoryUseTest, OnlyBatchesWithInsertsCountAsInserting) {
  EXPECT_FALSE(cost_of({}).inserts);
  EXPECT_FALSE(cost_of(moving()).inserts);
  UpdateBatch batch;
  batch.inserts.emplace_back();
  EXPECT_FALSE(cost_of(batch).inserts);
  batch.inserts.emplace_back().ids = kIds;
  EXPECT_TRUE(cost_of(batch).inserts);
}

TEST(MemoryUseTest, EveryItemOfABatchCostsTheSame) {
  UpdateBatch batch = moving();
  const uint64_t four = cost_of(batch).bytes;
  batch.inserts.emplace_back().ids = kIds;
  const uint64_t eight = cost_of(batch).bytes;
  batch.relabels.emplace_back().ids = kIds;
  EXPECT_EQ(cost_of(batch).bytes - eight, eight - four);
  EXPECT_GT(eight, four);
}

TEST(MemoryUseTest, AnUploadCostsMoreThanItsColumnsAndTheLargestDoesNotOverflow) {
  EXPECT_GT(upload_cost(100, 200), uint64_t{100 * 12 + 200 * 12 + 200 * 72});
  EXPECT_GT(upload_cost(limits::kMaxMeshVertices, limits::kMaxMeshTriangles), uint64_t{1} << 32);
}

TEST(MemoryUseTest, OnlyPlacementsCostMemory) {
  const std::array<double, 6> translations = {};
  StaticChange change;
  change.remove_ids = kIds;
  EXPECT_EQ(change_cost(*StaticSet::empty(), change), 0u);
  change.place.emplace_back().translations = translations;
  const uint64_t two = change_cost(*StaticSet::empty(), change);
  change.place.emplace_back().ids = kIds;
  EXPECT_EQ(change_cost(*StaticSet::empty(), change), 3 * two);
}

TEST(MemoryUseTest, TheProcessHoldsMemoryAndMoreOfItWhenItIsTouched) {
  const Registry registry;
  const MemoryBudget::Meter meter = process_memory(registry);
  const uint64_t before = meter.used();
  ASSERT_GT(before, 0u);
  const std::vector<char> touched(size_t{64} << 20, 'x');
  EXPECT_GT(meter.used(), before + touched.size() / 2);
}

TEST(MemoryUseTest, FreeingMemoryDropsTheOldRevisionsOfEveryScene) {
  Registry registry;
  std::vector<ScenePtr> scenes;
  for (const char* name : {"a", "b"}) scenes.push_back(registry.create_scene(name, {}, 1, "", false)->scene);
  for (const ScenePtr& scene : scenes) {
    UpdateBatch batch;
    batch.tick = 1;
    ASSERT_TRUE(scene->apply(batch).ok());
    ASSERT_TRUE(scene->view({View::Kind::kExactly, 0, 0}, kNow).ok());
  }
  process_memory(registry).release_memory();
  for (const ScenePtr& scene : scenes) {
    EXPECT_FALSE(scene->view({View::Kind::kExactly, 0, 0}, kNow).ok());
    EXPECT_TRUE(scene->view({View::Kind::kExactly, 1, 0}, kNow).ok());
  }
}

}  // namespace
}  // namespace locus::server
