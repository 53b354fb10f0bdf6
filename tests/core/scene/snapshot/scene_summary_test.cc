#include "core/scene/snapshot/scene_summary.h"

#include <thread>
#include <vector>

#include "tests/support/scene_fixture.h"

namespace locus::test {
namespace {

class SceneSummaryTest : public SceneFixture {};

TEST_F(SceneSummaryTest, AnEmptySceneHasNoBounds) {
  const SceneSummary summary = scene_.summary();
  EXPECT_EQ(summary.objects, 0u);
  EXPECT_TRUE(summary.bounds.empty());
}

TEST_F(SceneSummaryTest, TheBoundsContainAllObjectsExactly) {
  apply(with(points({1, 2, 3}, {1, 2, 3, -4, 5, 6, 7, -8, 9})));
  const SceneSummary summary = scene_.summary();
  EXPECT_EQ(summary.objects, 3u);
  EXPECT_EQ(summary.revision, 1u);
  EXPECT_EQ(summary.bounds.min, (Vec3d{-4, -8, 3}));
  EXPECT_EQ(summary.bounds.max, (Vec3d{7, 5, 9}));
}

TEST_F(SceneSummaryTest, ASummaryIsKnownUntilTheNextRevision) {
  EXPECT_FALSE(scene_.known_summary().has_value());
  EXPECT_EQ(scene_.summary().revision, 0u);
  ASSERT_TRUE(scene_.known_summary().has_value());
  apply(with(points({1}, {1, 2, 3})));
  EXPECT_FALSE(scene_.known_summary().has_value());
  EXPECT_EQ(scene_.summary().objects, 1u);
  EXPECT_EQ(scene_.known_summary()->revision, 1u);
}

TEST_F(SceneSummaryTest, ASummaryIsNeverOlderThanItsCall) {
  std::vector<std::thread> callers;
  std::atomic<bool> end{false};
  for (int i = 0; i < 3; ++i)
    callers.emplace_back([&] {
      while (!end.load()) {
        const uint64_t before = scene_.latest()->revision;
        const SceneSummary summary = scene_.summary();
        EXPECT_GE(summary.revision, before);
        EXPECT_EQ(summary.objects, summary.revision);  // each batch inserts one object
      }
    });
  for (Id id = 1; id <= 200; ++id) apply(with(points({id}, {0, 0, 0})));
  end.store(true);
  for (std::thread& caller : callers) caller.join();
}

}  // namespace
}  // namespace locus::test
