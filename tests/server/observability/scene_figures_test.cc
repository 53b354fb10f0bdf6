#include "server/observability/scene_figures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "server/config/observability_limits.h"

namespace locus::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<SceneFigures> scenes_named(const std::vector<std::string>& names) {
  std::vector<SceneFigures> scenes;
  for (const std::string& name : names) {
    SceneFigures scene;
    scene.name = name;
    scene.objects = 10;
    scene.revision = 3;
    scenes.push_back(scene);
  }
  return scenes;
}

std::vector<std::string> names_of(const std::vector<SceneFigures>& scenes) {
  std::vector<std::string> names;
  for (const SceneFigures& scene : scenes) names.push_back(scene.name);
  return names;
}

TEST(SceneFiguresTest, UpToTheMaximumEverySceneHasALabel) {
  SceneLabels labels(3);
  EXPECT_THAT(names_of(labels.label(scenes_named({"a", "b", "c"}))), ElementsAre("a", "b", "c"));
  EXPECT_THAT(names_of(labels.label({})), ElementsAre());
}

TEST(SceneFiguresTest, ScenesBeyondTheMaximumAreSummed) {
  SceneLabels labels(2);
  const std::vector<SceneFigures> shown = labels.label(scenes_named({"a", "b", "c", "d", "e"}));
  EXPECT_THAT(names_of(shown), ElementsAre("a", "b", "_other"));
  EXPECT_EQ(shown[0].objects, 10u);
  EXPECT_EQ(shown[2].objects, 30u);
  EXPECT_EQ(shown[2].revision, 9u);
}

TEST(SceneFiguresTest, ASceneKeepsItsLabelUntilItIsDeleted) {
  SceneLabels labels(2);
  labels.label(scenes_named({"m", "n"}));
  EXPECT_THAT(names_of(labels.label(scenes_named({"a", "m", "n"}))), ElementsAre("m", "n", "_other"));
  EXPECT_THAT(names_of(labels.label(scenes_named({"a", "n"}))), ElementsAre("a", "n"));
  EXPECT_THAT(names_of(labels.label(scenes_named({"a", "m", "n"}))), ElementsAre("a", "n", "_other"));
}

TEST(SceneFiguresTest, AThousandScenesMakeNoMoreLabelsThanTheLimit) {
  std::vector<std::string> names;
  for (int i = 0; i < 1000; ++i) names.push_back(absl::StrCat("scene-", i));
  std::sort(names.begin(), names.end());
  SceneLabels labels(kMaxLabelledScenes);
  MetricPage page;
  add_scene_figures(labels.label(scenes_named(names)), page);
  const std::string text = page.text();
  size_t lines = 0;
  for (size_t at = text.find("locus_scene_objects{"); at != std::string::npos;
       at = text.find("locus_scene_objects{", at + 1))
    ++lines;
  EXPECT_EQ(lines, kMaxLabelledScenes + 1);
  EXPECT_THAT(text, HasSubstr("locus_scene_objects{scene=\"_other\"} 9000\n"));
}

TEST(SceneFiguresTest, LedScenesAreShownOnTheirOwnAndCountedAmongTheOthers) {
  std::vector<SceneFigures> scenes = scenes_named({"a", "b", "c", "d"});
  scenes[0].leading = scenes[2].leading = scenes[3].leading = 1;
  SceneLabels labels(2);
  MetricPage with, without;
  const std::vector<SceneFigures> shown = labels.label(scenes);
  add_led_scenes(shown, with);
  EXPECT_THAT(with.text(), HasSubstr("locus_scene_leading{scene=\"a\"} 1\nlocus_scene_leading{scene=\"b\"} 0\n"
                                     "locus_scene_leading{scene=\"_other\"} 2\n"));
  add_scene_figures(shown, without);
  EXPECT_THAT(without.text(), testing::Not(HasSubstr("leading"))) << "a server without a cluster leads nothing";
}

}  // namespace
}  // namespace locus::server
