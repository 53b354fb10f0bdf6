// Tests Scene::Watch, the notification that a scene reached a revision.
#include <atomic>
#include <optional>
#include <thread>

#include "core/scene/scene.h"
#include "tests/support/scene_fixture.h"

namespace locus::test {
namespace {

class SceneWatchTest : public SceneFixture {
 protected:
  void tick() {
    UpdateBatch batch;
    batch.tick = scene_.latest()->tick + 1;
    apply(batch);
  }

  std::function<void()> count() {
    return [this] { ++notified_; };
  }

  std::atomic<int> notified_{0};
};

TEST_F(SceneWatchTest, AWatchNotifiesAtOnceIfTheRevisionIsReached) {
  tick();
  const Scene::Watch reached(scene_, 1, count());
  EXPECT_EQ(notified_, 1);
  const Scene::Watch passed(scene_, 0, count());
  EXPECT_EQ(notified_, 2);
}

TEST_F(SceneWatchTest, AWatchNotifiesOnceWhenItsRevisionIsPublished) {
  const Scene::Watch watch(scene_, 2, count());
  tick();
  EXPECT_EQ(notified_, 0);
  tick();
  EXPECT_EQ(notified_, 1);
  tick();
  EXPECT_EQ(notified_, 1);
}

TEST_F(SceneWatchTest, EveryWatchOfARevisionNotifies) {
  const Scene::Watch first(scene_, 1, count());
  const Scene::Watch second(scene_, 1, count());
  const Scene::Watch later(scene_, 2, count());
  tick();
  EXPECT_EQ(notified_, 2);
}

TEST_F(SceneWatchTest, ADestroyedWatchDoesNotNotify) {
  { const Scene::Watch watch(scene_, 1, count()); }
  tick();
  EXPECT_EQ(notified_, 0);
}

TEST_F(SceneWatchTest, AWatchNotifiesWhenTheSceneIsClosed) {
  const Scene::Watch before(scene_, 99, count());
  scene_.close();
  EXPECT_EQ(notified_, 1);
  const Scene::Watch after(scene_, 99, count());
  EXPECT_EQ(notified_, 2);
}

TEST_F(SceneWatchTest, WatchesAreCreatedAndDestroyedDuringUpdates) {
  constexpr uint64_t kRevisions = 2000;
  std::atomic<bool> over{false};
  std::thread watcher([&] {
    for (uint64_t revision = 1; !over; revision = scene_.latest()->revision + 1) {
      std::atomic<int> notified{0};
      std::optional<Scene::Watch> watch;
      watch.emplace(scene_, revision, [&notified] { ++notified; });
      if (revision % 2 == 0) watch.reset();
      while (watch && notified == 0 && !over) std::this_thread::yield();
      watch.reset();
      EXPECT_LE(notified, 1);
    }
  });
  for (uint64_t i = 0; i < kRevisions; ++i) tick();
  over = true;
  watcher.join();
  EXPECT_EQ(scene_.latest()->revision, kRevisions);
}

}  // namespace
}  // namespace locus::test
