#include "server/scheduling/lease_keeper.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "core/scene/recovery.h"
#include "tests/support/columns.h"
#include "tests/support/memory_log.h"
#include "tests/support/test_scale.h"

namespace locus::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using Time = LifetimeKeeper::Time;

std::vector<Id> objects_of(const Scene& scene) {
  std::vector<Id> ids;
  scene.latest()->objects.for_each([&](const Object& object) { ids.push_back(object.id); });
  std::sort(ids.begin(), ids.end());
  return ids;
}

// Returns a batch that inserts a point with the id `id`, or an empty batch for id 0.
UpdateBatch batch_of(uint64_t writer, uint64_t number, uint32_t lease_ms, Id id, test::Columns& columns) {
  UpdateBatch batch;
  batch.writer = writer;
  batch.batch = number;
  batch.lease_ms = lease_ms;
  if (id == 0) return batch;
  InsertColumns& insert = batch.inserts.emplace_back();
  insert.ids = columns.ids({id});
  insert.positions = columns.floats({0, 0, 0});
  return batch;
}

class LeaseKeeperTest : public ::testing::Test {
 protected:
  LeaseKeeperTest() : scene_(created("arena")) {}

  ScenePtr created(const std::string& name) {
    const auto created = registry_.create_scene(name, {}, ++epoch_, "", false);
    EXPECT_TRUE(created.ok()) << created.status();
    return created->scene;
  }
  // Does what the server does for a batch that arrives now and is applied at once.
  absl::StatusOr<UpdateAck> send(uint64_t writer, uint64_t number, uint32_t lease_ms, Id id = 0) {
    const LeaseKeeper::Batch batch = leases_.batch_arrived(scene_, writer, lease_ms);
    absl::StatusOr<UpdateAck> ack = scene_->apply(batch_of(writer, number, lease_ms, id, columns_));
    leases_.batch_done(batch, lease_ms);
    return ack;
  }
  // Advances the clock millisecond by millisecond to `ms`, and returns the objects of the scene then.
  std::vector<Id> objects_at(int64_t ms) {
    for (; now_ < Time(seconds(1000) + milliseconds(ms)); now_ += milliseconds(1)) keeper_.run_due();
    keeper_.run_due();
    return objects_of(*scene_);
  }

  Time now_ = Time(seconds(1000));
  test::MemoryLog log_;
  Registry registry_{&log_};
  LifetimeKeeper keeper_{[this] { return now_; }};
  std::vector<std::string> reports_;
  LeaseKeeper leases_{keeper_, [this](const Scene&, uint64_t writer, const absl::StatusOr<uint64_t>& status) {
                        reports_.push_back(std::to_string(writer) + (status.ok() ? "" : " failed"));
                        if (on_report_) on_report_();
                      }};
  std::function<void()> on_report_;
  test::Columns columns_;
  uint64_t epoch_ = 0;
  ScenePtr scene_;
};

TEST_F(LeaseKeeperTest, TheObjectsOfASilentWriterGoAsOneRevision) {
  ASSERT_TRUE(send(7, 1, 100, 1).ok());
  ASSERT_TRUE(send(7, 2, 0, 2).ok());
  ASSERT_TRUE(send(0, 0, 0, 3).ok());
  EXPECT_THAT(objects_at(99), ElementsAre(1u, 2u, 3u));
  const uint64_t revision = scene_->latest()->revision;
  EXPECT_THAT(objects_at(100), ElementsAre(3u));
  EXPECT_EQ(scene_->latest()->revision, revision + 1);
  EXPECT_THAT(reports_, ElementsAre("7"));
  EXPECT_EQ(leases_.ended(), 1u);
  EXPECT_EQ(leases_.leases(), 0u);
  EXPECT_EQ(keeper_.size(), 0u);
}

TEST_F(LeaseKeeperTest, EveryBatchOfTheWriterRenewsItsLease) {
  ASSERT_TRUE(send(7, 1, 100, 1).ok());
  EXPECT_THAT(objects_at(90), ElementsAre(1u));
  ASSERT_TRUE(send(7, 2, 0).ok());  // an empty batch
  EXPECT_THAT(objects_at(180), ElementsAre(1u));
  ASSERT_TRUE(send(7, 2, 0).ok());  // a duplicate
  EXPECT_THAT(objects_at(270), ElementsAre(1u));
  EXPECT_FALSE(send(7, 9, 0).ok());  // a refused batch
  EXPECT_THAT(objects_at(369), ElementsAre(1u));
  EXPECT_THAT(objects_at(370), IsEmpty());
}

TEST_F(LeaseKeeperTest, APartOfABatchRenewsTheLease) {
  ASSERT_TRUE(send(7, 1, 100, 1).ok());
  ASSERT_TRUE(send(8, 1, 100, 2).ok());
  EXPECT_THAT(objects_at(90), ElementsAre(1u, 2u));
  leases_.renew(scene_, 7);
  leases_.renew(scene_, 9);
  leases_.renew(scene_, 0);
  EXPECT_EQ(leases_.leases(), 2u) << "it begins no lease";
  EXPECT_THAT(objects_at(189), ElementsAre(1u));
  EXPECT_THAT(objects_at(190), IsEmpty());
}

TEST_F(LeaseKeeperTest, ALeaseIsShortenedThoughABatchThatAskedForItWasRefused) {
  ASSERT_TRUE(send(7, 1, 10'000, 1).ok());
  EXPECT_FALSE(send(7, 9, 100).ok());
  EXPECT_THAT(objects_at(150), ElementsAre(1u)) << "a refused batch changes no lease";
  ASSERT_TRUE(send(7, 2, 100).ok());
  EXPECT_THAT(objects_at(249), ElementsAre(1u));
  EXPECT_THAT(objects_at(250), IsEmpty());
}

TEST_F(LeaseKeeperTest, ALeaseThatBeginsRightAfterAnotherEndedIsKept) {
  ASSERT_TRUE(send(7, 1, 100, 1).ok());
  on_report_ = [this] { ASSERT_TRUE(send(7, 2, 100, 2).ok()); };  // the lease has ended, and is not forgotten yet
  EXPECT_THAT(objects_at(100), ElementsAre(2u));
  on_report_ = nullptr;
  EXPECT_EQ(leases_.leases(), 1u);
  EXPECT_THAT(objects_at(199), ElementsAre(2u));
  ASSERT_TRUE(send(7, 3, 0).ok());
  EXPECT_THAT(objects_at(298), ElementsAre(2u));
  EXPECT_THAT(objects_at(299), IsEmpty());
  EXPECT_EQ(leases_.leases(), 0u);
}

TEST_F(LeaseKeeperTest, ALeaseOfADeletedSceneIsForgotten) {
  const LeaseKeeper::Batch batch = leases_.batch_arrived(scene_, 7, 100);  // after the deletion was announced
  ASSERT_TRUE(registry_.delete_scene("arena").ok());
  scene_.reset();
  leases_.batch_done(batch, 100);
  EXPECT_EQ(leases_.leases(), 0u);
  EXPECT_EQ(keeper_.size(), 0u);
}

TEST_F(LeaseKeeperTest, BatchesOfOtherWritersDoNotRenewALease) {
  ASSERT_TRUE(send(7, 1, 100, 1).ok());
  ASSERT_TRUE(send(8, 1, 300, 2).ok());
  EXPECT_THAT(objects_at(90), ElementsAre(1u, 2u));
  ASSERT_TRUE(send(8, 2, 0).ok());
  ASSERT_TRUE(send(9, 1, 0).ok());
  ASSERT_TRUE(send(0, 0, 0).ok());
  EXPECT_THAT(objects_at(100), ElementsAre(2u));
  EXPECT_THAT(objects_at(390), IsEmpty());
}

TEST_F(LeaseKeeperTest, AnotherLengthTakesEffectWithItsBatch) {
  ASSERT_TRUE(send(7, 1, 1000, 1).ok());
  ASSERT_TRUE(send(7, 2, 50).ok());
  EXPECT_THAT(objects_at(49), ElementsAre(1u));
  EXPECT_THAT(objects_at(50), IsEmpty());
  ASSERT_TRUE(send(7, 3, 50, 1).ok());
  ASSERT_TRUE(send(7, 4, 500).ok());
  EXPECT_THAT(objects_at(549), ElementsAre(1u));
  EXPECT_THAT(objects_at(550), IsEmpty());
}

TEST_F(LeaseKeeperTest, ABatchThatWaitsKeepsTheLeaseUntilItIsDone) {
  ASSERT_TRUE(send(7, 1, 100, 1).ok());
  const LeaseKeeper::Batch waiting = leases_.batch_arrived(scene_, 7, 0);
  ASSERT_NE(waiting, nullptr);
  EXPECT_THAT(objects_at(500), ElementsAre(1u));
  ASSERT_TRUE(scene_->apply(batch_of(7, 2, 0, 2, columns_)).ok());
  leases_.batch_done(waiting, 0);
  EXPECT_THAT(objects_at(599), ElementsAre(1u, 2u));
  EXPECT_THAT(objects_at(600), IsEmpty());
}

// The decision is made while the first batch is being logged; a batch that arrives then wins.
TEST_F(LeaseKeeperTest, ABatchThatArrivesBeforeTheEndIsAppliedKeepsTheLease) {
  ASSERT_TRUE(send(7, 1, 100, 1).ok());
  log_.hold();
  std::thread other([&] { EXPECT_TRUE(scene_->apply(batch_of(0, 0, 0, 2, columns_)).ok()); });
  log_.wait_for_writer();  // another batch has the scene's writer
  now_ += milliseconds(100);
  std::thread keeper([&] { keeper_.run_due(); });
  const LeaseKeeper::Batch batch = leases_.batch_arrived(scene_, 7, 0);
  log_.release();
  other.join();
  keeper.join();
  EXPECT_THAT(objects_of(*scene_), ElementsAre(1u, 2u));
  leases_.batch_done(batch, 0);
  EXPECT_THAT(reports_, IsEmpty());
}

TEST_F(LeaseKeeperTest, ALeaseEndsOnceForEachSilence) {
  ASSERT_TRUE(send(7, 1, 100, 1).ok());
  EXPECT_THAT(objects_at(100), IsEmpty());
  ASSERT_TRUE(send(7, 2, 0, 2).ok());  // belongs to no lease
  EXPECT_THAT(objects_at(150), ElementsAre(2u));
  ASSERT_TRUE(send(7, 3, 100, 3).ok());
  EXPECT_THAT(objects_at(201), ElementsAre(2u, 3u)) << "the time of the ended lease does not count";
  EXPECT_THAT(objects_at(249), ElementsAre(2u, 3u));
  EXPECT_THAT(objects_at(250), ElementsAre(2u));
  EXPECT_THAT(objects_at(1000), ElementsAre(2u));
  EXPECT_THAT(reports_, ElementsAre("7", "7"));
}

TEST_F(LeaseKeeperTest, ARefusedBatchBeginsNoLease) {
  EXPECT_FALSE(send(7, 5, 86'400'000, 1).ok());
  EXPECT_EQ(leases_.leases(), 0u);
  EXPECT_EQ(keeper_.size(), 0u);
}

TEST_F(LeaseKeeperTest, ARefusedBatchLeavesTheLeaseThatAWaitingBatchBegins) {
  const LeaseKeeper::Batch waiting = leases_.batch_arrived(scene_, 7, 100);
  EXPECT_FALSE(send(7, 5, 100).ok());
  EXPECT_EQ(leases_.leases(), 1u);
  ASSERT_TRUE(scene_->apply(batch_of(7, 1, 100, 1, columns_)).ok());
  leases_.batch_done(waiting, 100);
  EXPECT_THAT(objects_at(99), ElementsAre(1u));
  EXPECT_THAT(objects_at(100), IsEmpty());
}

TEST_F(LeaseKeeperTest, TheLeasesOfADeletedSceneAreForgotten) {
  ASSERT_TRUE(send(7, 1, 100, 1).ok());
  ASSERT_TRUE(registry_.delete_scene("arena").ok());
  leases_.forget(*scene_);
  EXPECT_EQ(leases_.leases(), 0u);
  EXPECT_EQ(keeper_.size(), 0u);
  scene_ = created("arena");
  EXPECT_EQ(leases_.batch_arrived(scene_, 7, 0), nullptr);
}

TEST_F(LeaseKeeperTest, TheEndOfALeaseOfAClosedSceneDoesNothing) {
  ASSERT_TRUE(send(7, 1, 100, 1).ok());
  ASSERT_TRUE(registry_.delete_scene("arena").ok());
  objects_at(200);
  EXPECT_THAT(reports_, IsEmpty());
  EXPECT_EQ(leases_.leases(), 0u);
}

TEST_F(LeaseKeeperTest, AnEndThatTheLogRefusesIsTriedAgain) {
  ASSERT_TRUE(send(7, 1, 100, 1).ok());
  log_.fail_with(absl::ResourceExhaustedError("the disk is full"));
  EXPECT_THAT(objects_at(100), ElementsAre(1u));
  EXPECT_THAT(reports_, ElementsAre("7 failed"));
  log_.fail_with(absl::OkStatus());
  EXPECT_THAT(objects_at(1099), ElementsAre(1u));
  EXPECT_THAT(objects_at(1100), IsEmpty());
}

// After a crash every lease has its whole time again, and a logged end of a lease is not undone.
TEST_F(LeaseKeeperTest, ARestoredSceneHasItsLeasesWithTheirWholeTime) {
  ASSERT_TRUE(send(7, 1, 100, 1).ok());
  ASSERT_TRUE(send(8, 1, 500, 2).ok());
  EXPECT_THAT(objects_at(400), ElementsAre(2u));
  test::MemoryLog log(log_.crash());
  const absl::StatusOr<ScenePtr> restored =
      recover_scene(log, log.stored_scenes().front(), [](const MeshKey&) { return MeshPtr(); });
  ASSERT_TRUE(restored.ok()) << restored.status();
  LifetimeKeeper keeper([this] { return now_; });
  LeaseKeeper leases(keeper, [](const Scene&, uint64_t, const absl::StatusOr<uint64_t>&) {});
  leases.watch(*restored);
  EXPECT_EQ(leases.leases(), 1u);
  now_ += milliseconds(499);
  keeper.run_due();
  EXPECT_THAT(objects_of(**restored), ElementsAre(2u));
  now_ += milliseconds(1);
  keeper.run_due();
  EXPECT_THAT(objects_of(**restored), IsEmpty());
}

// At full speed: writers renew and begin leases while the keeper ends them. An object is removed only after its writer
// was silent: from the arrival of a batch until it is done, and while the clock stands, none of its objects goes.
TEST(LeaseKeeperThreadTest, NoLeaseEndsWhileItsWriterIsHeard) {
  constexpr int kWriters = 3;
  constexpr uint32_t kLength = 10;
  std::atomic<int64_t> now_ms{1'000'000};
  test::MemoryLog log;
  Registry registry(&log);
  const ScenePtr scene = registry.create_scene("arena", {}, 1, "", false)->scene;
  LifetimeKeeper keeper([&] { return Time(milliseconds(now_ms.load())); });
  LeaseKeeper leases(keeper, [](const Scene&, uint64_t, const absl::StatusOr<uint64_t>&) {});
  std::atomic<uint64_t> wrong{0};
  std::atomic<int> left{kWriters};
  std::vector<std::thread> threads;
  for (uint64_t writer = 1; writer <= kWriters; ++writer)
    threads.emplace_back([&, writer] {
      test::Columns columns;
      for (uint64_t number = 1; number <= test::scaled_count(400); number += 2) {
        const Id id = writer << 32 | number;
        const LeaseKeeper::Batch first = leases.batch_arrived(scene, writer, kLength);
        wrong += !scene->apply(batch_of(writer, number, kLength, id, columns)).ok();
        const LeaseKeeper::Batch second = leases.batch_arrived(scene, writer, 0);
        leases.batch_done(first, kLength);
        now_ms.fetch_add(2 * kLength);
        wrong += !scene->apply(batch_of(writer, number + 1, 0, 0, columns)).ok();
        wrong += !scene->latest()->objects.find(id).has_value();
        leases.batch_done(second, 0);
        if (number % 4 == 1) now_ms.fetch_add(2 * kLength);
      }
      --left;
    });
  while (left.load() > 0) keeper.run_due();
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong.load(), 0u);
  for (int round = 0; round < 3; ++round) {
    now_ms.fetch_add(2 * kLength);
    keeper.run_due();
  }
  EXPECT_THAT(objects_of(*scene), IsEmpty());
  EXPECT_EQ(leases.leases(), 0u);
  EXPECT_GT(leases.ended(), 0u);
}

}  // namespace
}  // namespace locus::server
