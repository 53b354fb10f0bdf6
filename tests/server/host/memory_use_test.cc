#include "server/host/memory_use.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

namespace locus::server {
namespace {

constexpr std::array<uint64_t, 4> kIds = {1, 2, 3, 4};

UpdateBatch moving() {
  UpdateBatch batch;
  batch.moves.emplace_back().ids = kIds;
  return batch;
}

TEST(MemoryUseTest, ABatchIsOfTheKindThatNeedsMostMemory) {
  UpdateBatch batch;
  batch.remove_ids = kIds;
  EXPECT_EQ(cost_of(batch).kind, UpdateCost::Kind::kRemoves);
  batch.moves.emplace_back().ids = kIds;
  EXPECT_EQ(cost_of(batch).kind, UpdateCost::Kind::kMoves);
  batch.inserts.emplace_back();
  EXPECT_EQ(cost_of(batch).kind, UpdateCost::Kind::kMoves);
  batch.inserts.emplace_back().ids = kIds;
  EXPECT_EQ(cost_of(batch).kind, UpdateCost::Kind::kInserts);
  EXPECT_EQ(item_count(batch), 3 * kIds.size());
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

TEST(MemoryUseTest, PartsOfCompoundsCost) {
  UpdateBatch batch = moving();
  const uint64_t before = cost_of(batch).bytes;
  batch.moves[0].parts_each = 16;
  const uint64_t parts = cost_of(batch).bytes - before;
  EXPECT_GT(parts, 16 * kIds.size() * 50);
  EXPECT_EQ(item_count(batch), 17 * kIds.size());
  const std::vector<float> positions(size_t{3} * 16);
  batch.inserts.emplace_back().parts.emplace_back().positions = positions;
  EXPECT_EQ(cost_of(batch).bytes - before - parts, parts / kIds.size());
}

TEST(MemoryUseTest, AChangedInstanceCostsAsMuchAsAPlacedOne) {
  UpdateBatch batch = moving();
  const uint64_t before = cost_of(batch).bytes;
  batch.instance_moves.emplace_back().ids = kIds;
  batch.instance_relabels.emplace_back().ids = kIds;
  EXPECT_EQ(cost_of(batch).bytes - before, change_cost(0, 2 * kIds.size()));
  EXPECT_EQ(item_count(batch), 3 * kIds.size());
}

TEST(MemoryUseTest, AnUploadAndItsTreeCostMoreThanTheyKeepAndTheLargestDoNotOverflow) {
  EXPECT_GT(upload_cost(100, 200), uint64_t{100 * 12 + 200 * 12});
  EXPECT_GT(tree_cost(200), uint64_t{200 * 72});
  EXPECT_GT(upload_cost(limits::kMaxMeshVertices, limits::kMaxMeshTriangles), uint64_t{1} << 32);
  EXPECT_GT(tree_cost(limits::kMaxMeshTriangles), uint64_t{1} << 32);
}

TEST(MemoryUseTest, PartsCostMemoryWithTheirNames) {
  const std::vector<MeshPart> two = {{"a", 0}, {std::string(200, 'b'), 1}};
  EXPECT_GE(parts_cost(two), parts_cost({}) + 2 * sizeof(MeshPart) + 201);
}

TEST(MemoryUseTest, OnlyPlacementsCostMemory) {
  EXPECT_EQ(change_cost(5, 0), 0u);
  EXPECT_EQ(change_cost(0, 6), 3 * change_cost(0, 2));
  EXPECT_EQ(change_cost(4, 2), change_cost(0, 6));
}

}  // namespace
}  // namespace locus::server
