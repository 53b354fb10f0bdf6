#include "client/cli/extras/render/thing_bounds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/cli/extras/render/render_scene.h"

namespace locus::cli {
namespace {

using ::testing::HasSubstr;

constexpr client::Rotation kQuarterAboutZ = {0, 0, 0.70710678f, 0.70710678f};

// Scene, far from the origin, with a city and objects whose bounds are known.
class ThingBoundsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    server_.create("arena");
    server_.place("arena", 1, server_.upload_city(600), kOut, kQuarterAboutZ, 0.5f);
    client::UpdateBuilder updates;
    updates.insert_ball(7, client::Double3{kOut.x + 3, kOut.y, 50}, 0.5f);
    updates.insert_box(8, client::Double3{kOut.x, kOut.y, 60}, {4, 1, 2}, kQuarterAboutZ);
    updates.insert_capsule(9, client::Double3{kOut.x, kOut.y, 70}, {0, 0, 3}, 1);
    updates.insert_point(10, client::Double3{kOut.x - 4, kOut.y, 80});
    updates.insert_ball(11, client::Double3{kOut.x, kOut.y, 90}, 2, {.layers = 0});
    updates.insert_ball(12, client::Double3{kOut.x + 2000, kOut.y, 0}, 1);
    server_.apply("arena", updates);
  }

  absl::StatusOr<Aabbd> find(uint64_t id) {
    const absl::StatusOr<v1::Scene> scene = server_.client().get_scene("arena");
    const Aabbd bounds = {{scene->min().x(), scene->min().y(), scene->min().z()},
                          {scene->max().x(), scene->max().y(), scene->max().z()}};
    return thing_bounds(server_.client(), "arena", server_.revision("arena"), id, bounds);
  }

  // Expects that the bounds of thing `id` enclose the box with centre `centre` and half extents `half`, and exceed that
  // box on each side by at most 1/12 of its size along the axis.
  void expect_bounds(uint64_t id, const Vec3d& centre, const Vec3d& half) {
    const absl::StatusOr<Aabbd> found = find(id);
    ASSERT_TRUE(found.ok()) << found.status();
    EXPECT_TRUE(contains(*found, Aabbd{centre - half, centre + half})) << id;
    for (int axis = 0; axis < 3; ++axis) {
      const double allowed = 2 * half[axis] / 12;
      EXPECT_GE(found->min[axis], centre[axis] - half[axis] - allowed) << id << " axis " << axis;
      EXPECT_LE(found->max[axis], centre[axis] + half[axis] + allowed) << id << " axis " << axis;
    }
  }

  static constexpr client::Double3 kOut = {3e6, -5e6, 0};
  RenderServer server_;
};

TEST_F(ThingBoundsTest, BoundsOfObjectsEncloseThemClosely) {
  expect_bounds(7, {kOut.x + 3, kOut.y, 50}, {0.5, 0.5, 0.5});
  expect_bounds(8, {kOut.x, kOut.y, 60}, {1, 4, 2});
  expect_bounds(9, {kOut.x, kOut.y, 70}, {1, 1, 4});
  expect_bounds(12, {kOut.x + 2000, kOut.y, 0}, {1, 1, 1});
}

TEST_F(ThingBoundsTest, BoundsOfAnInstanceEncloseItsPlacedTriangles) {
  const ImportedMesh city = generate_city(600, 7);
  Aabbd mesh;
  for (size_t i = 0; i < city.vertices.size(); i += 3) {
    mesh = merge(mesh, Vec3d{city.vertices[i], city.vertices[i + 1], city.vertices[i + 2]});
  }
  // The rotation is 90 degrees about z: (x, y) becomes (-y, x).
  const Aabbd placed = {{kOut.x - 0.5 * mesh.max.y, kOut.y + 0.5 * mesh.min.x, 0.5 * mesh.min.z},
                        {kOut.x - 0.5 * mesh.min.y, kOut.y + 0.5 * mesh.max.x, 0.5 * mesh.max.z}};
  const absl::StatusOr<Aabbd> found = find(1);
  ASSERT_TRUE(found.ok()) << found.status();
  for (int axis = 0; axis < 3; ++axis) {
    const double allowed = placed.extent()[axis] / 12;
    EXPECT_NEAR(found->min[axis], placed.min[axis], allowed);
    EXPECT_NEAR(found->max[axis], placed.max[axis], allowed);
  }
}

TEST_F(ThingBoundsTest, BoundsOfAPointEncloseItsPosition) {
  const absl::StatusOr<Aabbd> found = find(10);
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_LT(max_component(found->extent()), 1e-3);
  EXPECT_NEAR(found->min.x, kOut.x - 4, 1e-3);
  EXPECT_NEAR(found->min.z, 80, 1e-3);
}

TEST_F(ThingBoundsTest, AnUnknownIdIsNotFound) {
  const absl::Status status = find(99).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(status.message(), HasSubstr("scene arena has no object or instance 99"));
}

TEST_F(ThingBoundsTest, AHiddenObjectIsNotFoundAndTheErrorSaysWhy) {
  const absl::Status status = find(11).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(status.message(), HasSubstr("it is hidden (layers 0)"));
}

}  // namespace
}  // namespace locus::cli
