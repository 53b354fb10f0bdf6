#include "server/host/memory_lines.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <numeric>

namespace locus::server {
namespace {

constexpr uint64_t kLimit = uint64_t{1} << 30;

const MemoryLineUse& line_in(const std::vector<MemoryLineUse>& lines, const std::string& name) {
  for (const MemoryLineUse& line : lines)
    if (line.name == name) return line;
  ADD_FAILURE() << name << " is missing";
  return lines.front();
}

TEST(MemoryLinesTest, EveryLineHasACeilingAndTogetherTheyAccountForTheWholeProcess) {
  Registry registry;
  SceneSpec spec;
  spec.history = {100, kLimit};
  const ScenePtr scene = registry.create_scene("a", spec, 1, "", false)->scene;
  std::vector<uint64_t> ids(1000);
  std::iota(ids.begin(), ids.end(), 1);
  for (uint64_t tick = 1; tick <= 20; ++tick) {
    const std::array<float, 3> position = {static_cast<float>(tick), 0, 0};
    UpdateBatch batch;
    batch.upsert = true;
    batch.tick = tick;
    InsertColumns insert;
    insert.ids = ids;
    insert.positions = position;
    batch.inserts = {insert};
    ASSERT_TRUE(scene->apply(batch).ok());
  }
  constexpr uint64_t kUsed = kLimit / 2;
  MemoryBudget budget(kLimit, [] { return kUsed; });
  const absl::StatusOr<MemoryBudget::Claim> claim = budget.claim(MemoryLine::kDumps, "", 5000);
  const std::vector<MemoryLineUse> lines = memory_lines(budget, registry, nullptr);
  EXPECT_EQ(lines.size(), 7 + kMemoryLines);
  uint64_t sum = 0;
  for (const MemoryLineUse& line : lines) {
    EXPECT_GT(line.ceiling, 0u) << line.name;
    EXPECT_LE(line.ceiling, kLimit) << line.name;
    sum += line.used;
  }
  EXPECT_EQ(sum, kUsed);
  EXPECT_EQ(line_in(lines, "dumps").used, 5000u);
  EXPECT_TRUE(line_in(lines, "dumps").claimed);
  EXPECT_FALSE(line_in(lines, "history").claimed);
  EXPECT_EQ(line_in(lines, "history").used, scene->status().history_bytes);
  EXPECT_EQ(line_in(lines, "scenes").used, scene->status().memory_bytes);
}

TEST(MemoryLinesTest, WhatGrowthLeavesIsWhatTheNetworkMayTake) {
  const MemoryBudget budget(kLimit, [] { return uint64_t{0}; });
  EXPECT_EQ(budget.ceiling(MemoryLine::kInserts) + network_ceiling(kLimit), kLimit);
  EXPECT_LT(short_memory(kLimit), budget.ceiling(MemoryLine::kInserts));
}

}  // namespace
}  // namespace locus::server
