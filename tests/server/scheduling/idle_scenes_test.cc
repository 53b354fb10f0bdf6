#include "server/scheduling/idle_scenes.h"

#include <gmock/gmock.h>

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "server/scheduling/clocks.h"
#include "tests/support/memory_log.h"
#include "tests/support/test_scale.h"

namespace locus::server {
namespace {

using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using Time = LifetimeKeeper::Time;

class IdleScenesTest : public ::testing::Test {
 protected:
  ScenePtr created(const std::string& name, uint32_t idle_ttl_s) {
    SceneSpec spec;
    spec.idle_ttl_s = idle_ttl_s;
    const absl::StatusOr<Registry::CreatedScene> created = registry_.create_scene(name, spec, ++epoch_, "", false);
    EXPECT_TRUE(created.ok()) << created.status();
    idle_scenes_.watch(created->scene);
    return created->scene;
  }
  // Sets the clock and returns the names of the scenes that exist then.
  std::vector<std::string> scenes_at(int64_t s) {
    now_ = Time(seconds(1000 + s));
    keeper_.run_due();
    std::vector<std::string> names;
    for (const ScenePtr& scene : registry_.list_scenes("", 100)) names.push_back(scene->name());
    return names;
  }
  // Records a call that begins and ends now.
  void use(Scene& scene) {
    scene.uses().begin();
    scene.uses().end(nanoseconds_of(now_));
  }

  Time now_ = Time(seconds(1000));
  test::MemoryLog log_;
  Registry registry_{&log_};
  LifetimeKeeper keeper_{[this] { return now_; }};
  std::vector<std::string> reports_;
  IdleScenes idle_scenes_{keeper_, registry_, [this](const ScenePtr& scene, const absl::Status& status) {
                            reports_.push_back(scene->name() + (status.ok() ? "" : " failed"));
                          }};
  uint64_t epoch_ = 0;
};

TEST_F(IdleScenesTest, ASceneIsDeletedWhenItsTimeHasPassedSinceItsCreation) {
  const ScenePtr scene = created("arena", 10);
  created("lasting", 0);
  EXPECT_THAT(scenes_at(9), ElementsAre("arena", "lasting"));
  EXPECT_THAT(reports_, IsEmpty());
  EXPECT_THAT(scenes_at(10), ElementsAre("lasting"));
  EXPECT_THAT(reports_, ElementsAre("arena"));
  EXPECT_EQ(idle_scenes_.deleted(), 1u);
  EXPECT_EQ(idle_scenes_.watched(), 0u);
  EXPECT_EQ(keeper_.size(), 0u);
  EXPECT_TRUE(absl::IsNotFound(scene->apply({}).status())) << "closed as by delete_scene()";
  EXPECT_EQ(log_.crash().scenes.size(), 1u) << "the deletion is durable";
}

TEST_F(IdleScenesTest, EveryUseBeginsTheTimeAgain) {
  const ScenePtr scene = created("arena", 10);
  EXPECT_THAT(scenes_at(9), ElementsAre("arena"));
  use(*scene);
  EXPECT_THAT(scenes_at(18), ElementsAre("arena"));
  use(*scene);
  EXPECT_THAT(scenes_at(27), ElementsAre("arena"));
  EXPECT_THAT(scenes_at(28), IsEmpty());
}

TEST_F(IdleScenesTest, ACallThatRunsKeepsItsSceneAndItsEndBeginsTheTime) {
  const ScenePtr scene = created("arena", 10);
  scene->uses().begin();
  EXPECT_THAT(scenes_at(100), ElementsAre("arena"));
  EXPECT_THAT(scenes_at(105), ElementsAre("arena"));
  scene->uses().end(nanoseconds_of(now_));
  EXPECT_THAT(scenes_at(114), ElementsAre("arena"));
  EXPECT_THAT(scenes_at(115), IsEmpty());
}

TEST_F(IdleScenesTest, AnOpenStreamKeepsItsSceneAndTheEndOfTheLastOneBeginsTheTime) {
  created("arena", 10);
  idle_scenes_.stream_opened("arena");
  idle_scenes_.stream_opened("arena");
  EXPECT_THAT(scenes_at(100), ElementsAre("arena"));
  idle_scenes_.stream_closed("arena");
  EXPECT_THAT(scenes_at(200), ElementsAre("arena"));
  idle_scenes_.stream_closed("arena");
  EXPECT_THAT(scenes_at(209), ElementsAre("arena"));
  EXPECT_THAT(scenes_at(210), IsEmpty());
}

TEST_F(IdleScenesTest, AStreamServesALaterSceneOfItsName) {
  idle_scenes_.stream_opened("arena");
  const ScenePtr first = created("arena", 10);
  EXPECT_THAT(scenes_at(100), ElementsAre("arena"));
  ASSERT_TRUE(registry_.delete_scene("arena").ok());
  idle_scenes_.forget(*first);
  created("arena", 10);
  EXPECT_THAT(scenes_at(200), ElementsAre("arena"));
  idle_scenes_.stream_closed("arena");
  EXPECT_THAT(scenes_at(210), IsEmpty());
}

TEST_F(IdleScenesTest, ADeletedSceneIsForgottenAtOnce) {
  const ScenePtr first = created("arena", 31'536'000);
  ASSERT_TRUE(registry_.delete_scene("arena").ok());
  idle_scenes_.forget(*first);
  EXPECT_EQ(keeper_.size(), 0u);
  const ScenePtr second = created("arena", 10);
  idle_scenes_.forget(*first);
  EXPECT_EQ(idle_scenes_.watched(), 1u) << "another scene has the name now";
  EXPECT_THAT(scenes_at(10), IsEmpty());
}

TEST_F(IdleScenesTest, ASceneThatWasDeletedBeforeItIsWatchedIsNotWatched) {
  SceneSpec spec;
  spec.idle_ttl_s = 10;
  const ScenePtr scene = registry_.create_scene("arena", spec, 1, "", false)->scene;
  ASSERT_TRUE(registry_.delete_scene("arena").ok());
  idle_scenes_.watch(scene);
  EXPECT_EQ(idle_scenes_.watched(), 0u);
  EXPECT_EQ(keeper_.size(), 0u);
}

TEST_F(IdleScenesTest, AFailedDeletionIsTriedAgain) {
  created("arena", 10);
  log_.fail_with(absl::ResourceExhaustedError("the disk is full"));
  EXPECT_THAT(scenes_at(10), ElementsAre("arena"));
  EXPECT_THAT(reports_, ElementsAre("arena failed"));
  log_.fail_with(absl::OkStatus());
  EXPECT_THAT(scenes_at(14), ElementsAre("arena"));
  EXPECT_THAT(scenes_at(15), IsEmpty());
  EXPECT_EQ(idle_scenes_.deleted(), 1u);
}

// A batch that is being applied at the decision ends before it, and counts as a use.
TEST_F(IdleScenesTest, ACallThatBeginsBetweenTheDecisionAndTheDeletionKeepsTheScene) {
  const ScenePtr scene = created("arena", 10);
  log_.hold();
  std::thread writer([&] {
    UpdateBatch batch;
    batch.tick = 1;
    scene->uses().begin();
    EXPECT_TRUE(scene->apply(batch).ok());
    scene->uses().end(nanoseconds_of(Time(seconds(1010))));
  });
  log_.wait_for_writer();  // the batch holds the scene's writer
  now_ = Time(seconds(1010));
  std::thread keeper([&] { keeper_.run_due(); });
  log_.release();
  writer.join();
  keeper.join();
  EXPECT_THAT(scenes_at(19), ElementsAre("arena"));
  EXPECT_THAT(scenes_at(20), IsEmpty());
}

// At full speed: callers use scenes, streams open and close, and scenes are deleted as idle and created again. A caller
// whose use began before a deletion was decided never finds its scene deleted.
TEST(IdleScenesThreadTest, NoSceneIsDeletedWhileItIsUsed) {
  constexpr int kThreads = 3;
  std::atomic<int64_t> now_s{1000};
  LifetimeKeeper keeper([&] { return Time(seconds(now_s.load())); });
  Registry registry;
  IdleScenes idle_scenes(keeper, registry, [](const ScenePtr&, const absl::Status&) {});
  SceneSpec spec;
  spec.idle_ttl_s = 2;
  std::atomic<uint64_t> epoch{0}, wrong{0};
  const auto use = [&] {
    const absl::StatusOr<Registry::CreatedScene> created = registry.create_scene("arena", spec, ++epoch, "", true);
    if (!created.ok()) return;
    Scene& scene = *created->scene;
    if (!created->existed) idle_scenes.watch(created->scene);
    scene.uses().begin();
    if (scene.apply({}).ok()) {  // the scene was not deleted when this use began
      now_s.fetch_add(3);
      wrong += !scene.apply({}).ok();
    }
    scene.uses().end(nanoseconds_of(keeper.now()));
  };
  std::vector<std::thread> threads;
  std::atomic<int> left{kThreads};
  for (int number = 0; number < kThreads; ++number)
    threads.emplace_back([&] {
      for (uint64_t i = 0; i < test::scaled_count(300); ++i) {
        idle_scenes.stream_opened("arena");
        use();
        idle_scenes.stream_closed("arena");
        use();
        now_s.fetch_add(1);
      }
      --left;
    });
  while (left.load() > 0) keeper.run_due();
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong.load(), 0u);
  now_s.fetch_add(3);
  keeper.run_due();
  now_s.fetch_add(3);
  keeper.run_due();
  EXPECT_EQ(registry.scene_count(), 0u);
  EXPECT_GT(idle_scenes.deleted(), 0u);
}

}  // namespace
}  // namespace locus::server
