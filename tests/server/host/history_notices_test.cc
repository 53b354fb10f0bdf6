#include "server/host/history_notices.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

namespace locus::server {
namespace {

using std::chrono::minutes;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class HistoryNoticesTest : public ::testing::Test {
 protected:
  ScenePtr scene_of(const std::string& name, uint64_t history_bytes) {
    SceneSpec spec;
    spec.history = {300, history_bytes};
    return registry_.create_scene(name, spec, ++epoch_, "", false)->scene;
  }
  // Moves 1,000 points in each of `ticks` further ticks.
  static void live(Scene& scene, uint64_t ticks) {
    std::vector<uint64_t> ids(1000);
    std::iota(ids.begin(), ids.end(), 1);
    UpdateBatch batch;
    batch.upsert = true;
    for (uint64_t i = 0; i < ticks; ++i) {
      const float position[3] = {static_cast<float>(i), 0, 0};
      InsertColumns insert;
      insert.ids = ids;
      insert.positions = position;
      batch.inserts = {insert};
      batch.tick = scene.latest()->tick + 1;
      ASSERT_TRUE(scene.apply(batch).ok());
    }
  }
  // Returns the lines that a check logs `after` the previous check.
  std::string logged(std::chrono::steady_clock::duration after) {
    now_ += after;
    testing::internal::CaptureStderr();
    notices_.check(registry_.list_scenes("", 100), now_);
    return testing::internal::GetCapturedStderr();
  }

  Registry registry_;
  uint64_t epoch_ = 0;
  HistoryNotices notices_;
  HistoryNotices::Time now_{};
};

TEST_F(HistoryNoticesTest, ASceneThatForgetsEarlyIsLoggedOnceInAnEpisode) {
  const ScenePtr large = scene_of("large", uint64_t{1} << 30), small = scene_of("small", 500'000);
  live(*large, 20);
  EXPECT_THAT(logged(minutes(1)), IsEmpty());
  live(*small, 20);
  EXPECT_THAT(logged(minutes(1)), AllOf(HasSubstr("history is shorter than asked for"), HasSubstr("scene=small"),
                                        HasSubstr("asked_ticks=300"), HasSubstr("reason=history_bytes")));
  live(*small, 20);
  EXPECT_THAT(logged(minutes(60)), IsEmpty());
}

TEST_F(HistoryNoticesTest, ANewEpisodeIsLoggedAgain) {
  const ScenePtr scene = scene_of("small", 500'000);
  live(*scene, 20);
  EXPECT_THAT(logged(minutes(1)), HasSubstr("scene=small"));
  UpdateBatch restart;
  restart.restart_ticks = true;
  restart.tick = 1;
  ASSERT_TRUE(scene->apply(restart).ok());
  EXPECT_THAT(logged(minutes(1)), IsEmpty());
  live(*scene, 20);
  EXPECT_THAT(logged(minutes(1)), IsEmpty()) << "the same episode";
  ASSERT_TRUE(scene->apply(restart).ok());
  EXPECT_THAT(logged(HistoryNotices::kEpisodeGap), IsEmpty());
  live(*scene, 20);
  EXPECT_THAT(logged(minutes(1)), HasSubstr("scene=small"));
}

}  // namespace
}  // namespace locus::server
