#include "server/host/memory_keeper.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <numeric>
#include <thread>

#include "server/host/memory_lines.h"

namespace locus::server {
namespace {

TEST(ShrunkSizesTest, PartsGiveWayInProportionToTheirSizes) {
  EXPECT_THAT(shrunk_sizes({1000, 3000}, 2000), testing::ElementsAre(500, 1500));
  EXPECT_THAT(shrunk_sizes({1000, 3000}, 0), testing::ElementsAre(1000, 3000));
  EXPECT_THAT(shrunk_sizes({1000, 3000}, 4000), testing::ElementsAre(0, 0));
  EXPECT_THAT(shrunk_sizes({1000, 3000}, 9000), testing::ElementsAre(0, 0));
  EXPECT_THAT(shrunk_sizes({}, 5), testing::IsEmpty());
}

class MemoryKeeperTest : public testing::Test {
 protected:
  static constexpr uint64_t kLimit = uint64_t{1} << 30;

  // Creates a scene whose history has `ticks` records of 1,000 moved points each.
  void add_scene(const std::string& name, uint64_t ticks) {
    SceneSpec spec;
    spec.history = {1000, kLimit};
    const ScenePtr scene = registry_.create_scene(name, spec, 1, "", false)->scene;
    std::vector<uint64_t> ids(1000);
    std::iota(ids.begin(), ids.end(), 1);
    UpdateBatch batch;
    batch.upsert = true;
    for (uint64_t tick = 1; tick <= ticks; ++tick) {
      const float position[3] = {static_cast<float>(tick), 0, 0};
      InsertColumns insert;
      insert.ids = ids;
      insert.positions = position;
      batch.inserts = {insert};
      batch.tick = tick;
      ASSERT_TRUE(scene->apply(batch).ok());
    }
  }
  uint64_t history(const std::string& name) const { return (*registry_.find_scene(name))->status().history_bytes; }

  std::atomic<uint64_t> used_{0};
  std::atomic<int> looks_{0}, closes_{0};
  const MemoryKeeper::Shed shed_ = [this](bool close) {
    (close ? closes_ : looks_).fetch_add(1);
    return size_t{0};
  };
  Registry registry_;
  MemoryBudget budget_{kLimit, [this] { return used_.load(); }};
};

TEST_F(MemoryKeeperTest, HistoriesStayWhileThereIsMemory) {
  add_scene("a", 50);
  const uint64_t before = history("a");
  MemoryKeeper keeper(budget_, registry_, shed_);
  used_ = kLimit / 4 * 3;
  keeper.keep();
  EXPECT_EQ(history("a"), before);
  EXPECT_EQ(keeper.trimmed_bytes(), 0u);
}

TEST_F(MemoryKeeperTest, AllHistoriesGiveWayWhenMemoryIsShort) {
  add_scene("a", 50);
  add_scene("b", 100);
  const uint64_t before = history("a") + history("b");
  MemoryKeeper keeper(budget_, registry_, shed_);
  used_ = kLimit / 4 * 3 + before / 2;
  keeper.keep();
  EXPECT_GE(keeper.trimmed_bytes(), before / 2);
  EXPECT_GT(history("a"), 0u);
  EXPECT_GT(history("b"), history("a"));
  used_ = kLimit;
  keeper.keep();
  EXPECT_EQ(history("a") + history("b"), 0u);
}

// Returns whether the scene still has its first revision.
bool has_first_revision(const ScenePtr& scene) {
  return scene->view({View::Kind::kExactly, 0, 0}, std::chrono::steady_clock::time_point::min()).ok();
}

TEST_F(MemoryKeeperTest, OnlyTheKeeperDropsOldRevisionsAfterAClaimWasRefused) {
  const ScenePtr scene = registry_.create_scene("a", {}, 1, "", false)->scene;
  UpdateBatch batch;
  batch.tick = 1;
  ASSERT_TRUE(scene->apply(batch).ok());
  used_ = kLimit / 2;
  budget_.refresh();
  EXPECT_FALSE(budget_.claim(MemoryLine::kUploads, "mesh", kLimit / 2).ok());
  EXPECT_TRUE(has_first_revision(scene));
  const MemoryKeeper keeper(budget_, registry_, shed_);
  while (has_first_revision(scene)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(scene->latest()->revision, 1u);
}

TEST_F(MemoryKeeperTest, ReadersOfOldRevisionsAreCancelledWhenMemoryIsFull) {
  add_scene("a", 0);
  const ScenePtr scene = *registry_.find_scene("a");
  std::vector<uint64_t> ids(20'000);
  std::iota(ids.begin(), ids.end(), 1);
  const float position[3] = {0, 0, 0};
  InsertColumns insert;
  insert.ids = ids;
  insert.positions = position;
  UpdateBatch batch;
  batch.inserts = {insert};
  ASSERT_TRUE(scene->apply(batch).ok());
  const absl::StatusOr<SnapshotPin> reader = scene->pin(View(), ReaderTracker::kNever);
  ASSERT_TRUE(reader.ok());
  UpdateBatch removal;
  removal.clear = true;
  ASSERT_TRUE(scene->apply(removal).ok());
  const uint64_t held = scene->status().pinned_bytes;
  ASSERT_GT(held, 0u);
  used_ = kLimit / 8 * 7 - held;  // memory is short, but not so short that inserts are refused
  {
    MemoryKeeper keeper(budget_, registry_, shed_);
    keeper.keep();
    EXPECT_EQ(keeper.revoked_bytes(), 0u);
  }
  EXPECT_TRUE(reader->status().ok());
  used_ = kLimit / 8 * 7 + held;
  MemoryKeeper keeper(budget_, registry_, shed_);
  keeper.keep();
  EXPECT_EQ(reader->status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(keeper.revoked_bytes(), held);
}

TEST_F(MemoryKeeperTest, ConnectionsAreMeasuredWhenMemoryIsShortAndClosedWhenItIsNearlyFull) {
  used_ = kLimit / 2;
  MemoryKeeper keeper(budget_, registry_, shed_);
  keeper.keep();
  EXPECT_EQ(looks_.load(), 0);
  used_ = kLimit / 8 * 7;
  keeper.keep();
  EXPECT_GE(looks_.load(), 1);
  EXPECT_EQ(closes_.load(), 0);
  used_ = kLimit;
  keeper.keep();
  EXPECT_GE(closes_.load(), 1);
}

TEST_F(MemoryKeeperTest, TheUseOfEachLineIsLoggedOnceWhenMemoryIsShort) {
  add_scene("a", 5);
  const auto logged = [&] {
    testing::internal::CaptureStderr();
    {
      MemoryKeeper keeper(budget_, registry_, shed_);
      for (int i = 0; i < 3; ++i) keeper.keep();
    }
    return testing::internal::GetCapturedStderr();
  };
  used_ = kLimit / 2;
  EXPECT_THAT(logged(), testing::Not(testing::HasSubstr("what it is used for")));
  used_ = kLimit / 8 * 7;
  const std::string text = logged();
  const size_t first = text.find("what it is used for");
  ASSERT_NE(first, std::string::npos) << text;
  EXPECT_EQ(text.find("what it is used for", first + 1), std::string::npos) << text;
  for (const MemoryLineUse& line : memory_lines(budget_, registry_, nullptr))
    EXPECT_THAT(text, testing::HasSubstr(line.name + "="));
}

}  // namespace
}  // namespace locus::server
