#include "client/cli/levels/export/scene_export.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>

#include "client/cli/levels/export/unit_shapes.h"
#include "client/cli/levels/import/import_file.h"
#include "tests/client/cli/levels/export/glb_file.h"

namespace locus::cli {
namespace {

using testing::expect_valid;
using testing::GlbFile;
using testing::read_glb;
using Corner = std::array<double, 3>;

SceneThing thing(ThingKind kind, uint64_t id, const Corner& at) {
  SceneThing result;
  result.kind = kind;
  result.id = id;
  result.at = at;
  return result;
}

SceneThing ball(uint64_t id, const Corner& at, float radius) {
  SceneThing result = thing(ThingKind::kBall, id, at);
  result.radius = radius;
  return result;
}

class SceneExportTest : public ::testing::Test {
 protected:
  ~SceneExportTest() override { unlink(path_.c_str()); }

  GlbFile written(const SceneExport& scene) {
    const absl::StatusOr<uint64_t> bytes = scene.writer().write(path_);
    EXPECT_TRUE(bytes.ok()) << bytes.status();
    GlbFile file = read_glb(path_);
    expect_valid(file);
    return file;
  }

  // Returns the triangles of the written file in world coordinates.
  ImportedMesh placed() {
    absl::StatusOr<ImportedLevel> level = import_file(path_, {});
    EXPECT_TRUE(level.ok()) << level.status();
    if (!level.ok()) return {};
    ImportedMesh mesh = std::move(level->meshes[0]);
    for (size_t i = 0; i < mesh.vertices.size(); ++i) mesh.vertices[i] += static_cast<float>(level->recentre[i % 3]);
    return mesh;
  }

  void expect_bounds(const Corner& min, const Corner& max) {
    const ImportedMesh mesh = placed();
    for (size_t axis = 0; axis < 3; ++axis) {
      double low = INFINITY;
      double high = -INFINITY;
      for (size_t i = axis; i < mesh.vertices.size(); i += 3) {
        low = std::min(low, double{mesh.vertices[i]});
        high = std::max(high, double{mesh.vertices[i]});
      }
      EXPECT_NEAR(low, min[axis], 1e-5) << axis;
      EXPECT_NEAR(high, max[axis], 1e-5) << axis;
    }
  }

  const std::string path_ = ::testing::TempDir() + "scene_export_test_" + std::to_string(getpid()) + ".glb";
};

TEST_F(SceneExportTest, ABallKeepsItsPositionAndRadius) {
  SceneExport scene("arena", UpAxis::kY, {});
  ASSERT_TRUE(scene.add(ball(7, {1, 2, 3}, 0.5f)).ok());
  const GlbFile file = written(scene);
  EXPECT_EQ(file.node("object 7")["extras"]["id"], "7");
  EXPECT_EQ(file.node("object 7")["extras"]["shape"], "ball");
  expect_bounds({0.5, 1.5, 2.5}, {1.5, 2.5, 3.5});
}

TEST_F(SceneExportTest, ABoxIsRotatedAndScaled) {
  SceneExport scene("arena", UpAxis::kY, {});
  SceneThing box = thing(ThingKind::kBox, 9, {4, 0, 0});
  box.size = {1, 2, 3};
  const auto half = static_cast<float>(std::sqrt(0.5));
  box.rotation = {0, 0, half, half};  // 90 degrees about z: x becomes y
  ASSERT_TRUE(scene.add(box).ok());
  written(scene);
  expect_bounds({2, -1, -3}, {6, 1, 3});
  EXPECT_EQ(placed().indices.size(), 36u);
}

TEST_F(SceneExportTest, ACapsuleIsATubeAndTwoDomesAlongItsAxis) {
  SceneExport scene("arena", UpAxis::kY, {});
  SceneThing capsule = thing(ThingKind::kCapsule, 10, {0, 3, 0});
  capsule.radius = 0.25f;
  capsule.size = {0, 2, 0};
  ASSERT_TRUE(scene.add(capsule).ok());
  const GlbFile file = written(scene);
  EXPECT_EQ(file.node("object 10")["children"].size(), 3u);
  expect_bounds({-0.25, 0.75, -0.25}, {0.25, 5.25, 0.25});
}

TEST_F(SceneExportTest, CapsulesOfEveryDirectionReachTheirEndsAndAreClosed) {
  for (const std::array<float, 3>& axis : std::vector<std::array<float, 3>>{
           {0, 0, 2}, {0, 0, -2}, {2, 0, 0}, {-2, 0, 0}, {1, 1, 1}, {-1, 2, -0.5f}, {0, 1e-4f, -1}}) {
    SceneExport scene("arena", UpAxis::kY, {});
    SceneThing capsule = thing(ThingKind::kCapsule, 1, {0, 0, 0});
    capsule.radius = 0.5f;
    capsule.size = axis;
    ASSERT_TRUE(scene.add(capsule).ok());
    written(scene);
    const double length = std::hypot(axis[0], axis[1], axis[2]);
    const ImportedMesh mesh = placed();
    double furthest = 0;
    for (size_t i = 0; i < mesh.vertices.size(); i += 3) {
      const double along =
          (mesh.vertices[i] * axis[0] + mesh.vertices[i + 1] * axis[1] + mesh.vertices[i + 2] * axis[2]) / length;
      const double from_core = std::hypot(mesh.vertices[i] - axis[0] / length * std::clamp(along, -length, length),
                                          mesh.vertices[i + 1] - axis[1] / length * std::clamp(along, -length, length),
                                          mesh.vertices[i + 2] - axis[2] / length * std::clamp(along, -length, length));
      ASSERT_NEAR(from_core, 0.5, 1e-5);
      furthest = std::max(furthest, std::abs(along));
    }
    EXPECT_NEAR(furthest, length + 0.5, 1e-5);
  }
}

TEST_F(SceneExportTest, ShapesWithoutSizeAreStillDrawn) {
  SceneExport scene("arena", UpAxis::kY, {});
  ASSERT_TRUE(scene.add(thing(ThingKind::kPoint, 1, {5, 0, 0})).ok());
  ASSERT_TRUE(scene.add(ball(2, {5, 0, 0}, 0)).ok());
  SceneThing capsule = thing(ThingKind::kCapsule, 3, {5, 0, 0});
  capsule.radius = 0.01f;
  ASSERT_TRUE(scene.add(capsule).ok());
  ASSERT_TRUE(scene.add(thing(ThingKind::kBox, 4, {5, 0, 0})).ok());
  const GlbFile file = written(scene);
  EXPECT_EQ(file.json["meshes"].size(), 3u) << "marker, ball and box";
  EXPECT_EQ(file.node("object 4")["scale"][2].get<float>(), kMinDrawnSize);
  EXPECT_EQ(file.node("object 3")["mesh"], file.node("object 2")["mesh"]) << "a capsule without an axis is a ball";
  expect_bounds({5 - kPointMarkSize, -kPointMarkSize, -kPointMarkSize},
                {5 + kPointMarkSize, kPointMarkSize, kPointMarkSize});
}

TEST_F(SceneExportTest, InstancesDrawTheirMeshWithItsTransform) {
  SceneExport scene("arena", UpAxis::kY, {});
  SceneThing instance = thing(ThingKind::kInstance, 3, {10, 20, 30});
  instance.mesh = "crate";
  instance.scale = 2;
  instance.group = 5;
  ASSERT_TRUE(scene.add(instance).ok());
  instance.id = 4;
  instance.at = {-10, 20, 30};
  ASSERT_TRUE(scene.add(instance).ok());
  EXPECT_EQ(scene.meshes(), std::vector<std::string>{"crate"});
  ImportedMesh crate = unit_box();
  crate.name = "crate";
  ASSERT_TRUE(scene.set_mesh("crate", crate).ok());
  const GlbFile file = written(scene);
  EXPECT_EQ(file.json["meshes"].size(), 1u);
  EXPECT_EQ(file.node("instance 3 (crate)")["extras"]["group"], "5");
  expect_bounds({-12, 18, 28}, {12, 22, 32});
  EXPECT_EQ(placed().indices.size(), 72u);
}

TEST_F(SceneExportTest, FarScenesAreMovedBeforeRounding) {
  const std::array<double, 3> recentre = {123456789, 0, 0};
  SceneExport scene("arena", UpAxis::kY, recentre);
  ASSERT_TRUE(scene.add(ball(1, {123456789.125, 0, 0}, 0.5f)).ok());
  const GlbFile file = written(scene);
  EXPECT_EQ(file.node("object 1")["translation"][0], 0.125);
}

TEST(RecentreTest, OnlyBoundsFurtherThanEightTimesTheirSizeAreMoved) {
  EXPECT_EQ(recentre_of({-10, -10, 0}, {10, 10, 5}), (Corner{0, 0, 0}));
  EXPECT_EQ(recentre_of({79, 0, 0}, {89, 10, 5}), (Corner{84, 5, 3}));
  EXPECT_EQ(recentre_of({70, 0, 0}, {80, 10, 5}), (Corner{0, 0, 0}));
}

}  // namespace
}  // namespace locus::cli
