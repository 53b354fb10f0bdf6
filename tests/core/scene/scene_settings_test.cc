#include <gmock/gmock.h>

#include "core/scene/recovery.h"
#include "core/scene/registry.h"
#include "tests/support/memory_log.h"
#include "tests/support/scene_fixture.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Pair;

class SceneSettingsTest : public SceneFixture {
 protected:
  SceneSettingsTest() {
    SceneSpec spec;
    spec.labels = {{"map", "harbour"}};
    spec.cell_size = 4;
    spec.history = {8, 1 << 20};
    logged_ = registry_.create_scene("arena", spec, kEpoch, "", false)->scene;
    EXPECT_TRUE(logged_->apply(with(points({1, 2, 3}, {0, 0, 0, 1, 1, 1, 9, 9, 9}))).ok());
  }

  ScenePtr recovered() {
    again_ = std::make_unique<MemoryLog>(log_.crash());
    const absl::StatusOr<ScenePtr> scene = recover_scene(
        *again_, again_->stored_scenes().front(), [](const MeshKey&) { return nullptr; }, nullptr);
    EXPECT_TRUE(scene.ok()) << scene.status();
    return *scene;
  }
  static double cell_size_of(const Scene& scene) { return scene.latest()->objects.grid().cell_size(); }

  MemoryLog log_;
  Registry registry_{&log_};
  ScenePtr logged_;
  std::unique_ptr<MemoryLog> again_;
};

TEST_F(SceneSettingsTest, ASceneHasTheCellSizeOfItsSpecificationAlsoAfterARestart) {
  EXPECT_EQ(cell_size_of(*logged_), 4);
  EXPECT_EQ(logged_->settings().cell_size, 4);
  const ScenePtr scene = recovered();
  EXPECT_EQ(cell_size_of(*scene), 4);
  EXPECT_EQ(scene->settings().cell_size, 4);
}

TEST_F(SceneSettingsTest, ChangesMakeNoRevisionAndSurviveARestart) {
  const SnapshotPtr before = logged_->latest();
  const absl::StatusOr<SceneSettings> sized = logged_->change_settings({std::nullopt, 0.5});
  ASSERT_TRUE(sized.ok()) << sized.status();
  EXPECT_EQ(sized->cell_size, 0.5);
  EXPECT_THAT(sized->labels, ElementsAre(Pair("map", "harbour"))) << "other settings stay";
  ASSERT_TRUE(logged_->change_settings({{{{"mode", "ctf"}}}, std::nullopt}).ok());
  EXPECT_EQ(logged_->latest(), before);
  ASSERT_TRUE(logged_->apply(with(move_to({1}, {5, 0, 0}))).ok());
  EXPECT_EQ(cell_size_of(*logged_), 0.5);
  const ScenePtr scene = recovered();
  EXPECT_EQ(scene->latest()->revision, before->revision + 1);
  EXPECT_EQ(scene->settings().cell_size, 0.5);
  EXPECT_EQ(cell_size_of(*scene), 0.5);
  EXPECT_THAT(scene->settings().labels, ElementsAre(Pair("mode", "ctf")));
  ASSERT_TRUE(logged_->change_settings({std::map<std::string, std::string>(), 0.0}).ok());
  EXPECT_THAT(recovered()->settings().labels, IsEmpty());
  EXPECT_EQ(recovered()->settings().cell_size, 0);
}

TEST_F(SceneSettingsTest, AChangeThatIsNotLoggedIsNotMade) {
  log_.fail_with(absl::UnavailableError("the disk is gone"));
  EXPECT_EQ(logged_->change_settings({std::map<std::string, std::string>(), 64.0}).status(),
            absl::UnavailableError("the disk is gone"));
  log_.fail_with(absl::OkStatus());
  EXPECT_EQ(logged_->settings().cell_size, 4);
  EXPECT_THAT(logged_->settings().labels, ElementsAre(Pair("map", "harbour")));
  ASSERT_TRUE(logged_->apply(with(move_to({1}, {5, 0, 0}))).ok());
  EXPECT_EQ(cell_size_of(*logged_), 4);
}

TEST_F(SceneSettingsTest, ADeletedSceneIsNotChanged) {
  ASSERT_TRUE(registry_.delete_scene("arena").ok());
  EXPECT_EQ(logged_->change_settings({std::nullopt, 2.0}).status().code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace locus::test
