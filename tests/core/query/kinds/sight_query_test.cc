// Sight, mostly in a small world with a wall of group 7 at x = 4 and a ball of group 8 at x = 6. Viewers and targets
// stand on both sides of the wall and of the ball.
#include "core/query/kinds/sight_query.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/support/generated_meshes.h"
#include "tests/support/random.h"
#include "tests/support/small_world.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

SnapshotPtr wall_and_ball() {
  QueryWorld world;
  PlacedMesh wall = placed(100, wall_mesh(), {4, 0, 0});
  wall.group = 7;
  Object ball = ball_object(1, {6, 0, 0}, 0.5f);
  ball.group = 8;
  world.instances = {wall};
  world.objects = {ball};
  return snapshot_of(world);
}

OwnedBlock looks(std::vector<float> viewers, std::vector<float> targets, SightColumns sight = {}) {
  OwnedBlock block;
  block.settings.kind = sight;
  block.points = std::move(viewers);
  block.sizes = std::move(targets);
  return block;
}

std::vector<int> ask(const OwnedBlock& block, const SnapshotPtr& snapshot = wall_and_ball()) {
  const BlockResult result = run_block(*snapshot, block);
  std::vector<int> seen;
  for (const char byte : result.matrix) seen.push_back(static_cast<uint8_t>(byte));
  return seen;
}

using Seen = std::vector<int>;

TEST(SightQueryTest, TheMatrixIsViewerByViewer) {
  EXPECT_EQ(ask(looks({0, 0, 0, 8, 0, 0}, {3, 0, 0, 5, 0, 0, 9, 0, 0})), (Seen{1, 0, 0, 0, 0, 1}));
}

TEST(SightQueryTest, WhatTheSegmentEndsAtBlocks) {
  EXPECT_EQ(ask(looks({0, 0, 0}, {4, 0, 0})), Seen{0});
  EXPECT_EQ(ask(looks({0, 0, 0}, {3.999f, 0, 0})), Seen{1});
}

TEST(SightQueryTest, TheByteCountsTheSeenSamples) {
  SightColumns sight;
  sight.samples = 3;
  EXPECT_EQ(ask(looks({0, 0, 0}, {5, 0, 0, 5, 0, 90, 3, 0, 0}, sight)), Seen{2});
}

TEST(SightQueryTest, OneEyeIsEnough) {
  SightColumns sight;
  sight.eyes = 2;
  EXPECT_EQ(ask(looks({0, 0, 0, 5, 0, 0}, {3, 0, 0, 5.25f, 0, 0, 9, 0, 0}, sight)), (Seen{1, 1, 0}));
}

TEST(SightQueryTest, TheGroupsOfViewerAndTargetDoNotBlock) {
  OwnedBlock block = looks({0, 0, 0}, {5, 0, 0, 9, 0, 0});
  block.groups = {7};
  EXPECT_EQ(ask(block), (Seen{1, 0}));
  block.target_groups = {0, 8};
  EXPECT_EQ(ask(block), (Seen{1, 1}));
  block.groups = {8};
  block.target_groups = {7};
  EXPECT_EQ(ask(block), (Seen{1, 1}));
}

TEST(SightQueryTest, GroupZeroIsNoGroup) {
  QueryWorld world;
  world.objects = {ball_object(1, {2, 0, 0})};
  OwnedBlock block = looks({0, 0, 0}, {9, 0, 0});
  block.groups = {0};
  block.target_groups = {0};
  EXPECT_EQ(ask(block, snapshot_of(world)), Seen{0});
}

TEST(SightQueryTest, EqualPointsSeeEachOther) { EXPECT_EQ(ask(looks({6, 0, 0}, {6, 0, 0})), Seen{1}); }

TEST(SightQueryTest, AnEyeInsideAnObjectSeesNothingElse) { EXPECT_EQ(ask(looks({6, 0, 0}, {6, 0, 9})), Seen{0}); }

TEST(SightQueryTest, BeyondTheMaximumDistanceNothingIsSeen) {
  OwnedBlock block = looks({0, 0, 0}, {0, 3, 0, 0, 3.001f, 0});
  block.extras = {3};
  EXPECT_EQ(ask(block), (Seen{1, 0}));
}

TEST(SightQueryTest, PairwiseAsksOneTargetPerViewer) {
  SightColumns sight;
  sight.pairwise = true;
  OwnedBlock block = looks({0, 0, 0, 8, 0, 0}, {9, 0, 0, 9, 0, 0}, sight);
  EXPECT_EQ(ask(block), (Seen{0, 1}));
  block.target_groups = {7, 0};
  block.groups = {8, 0};
  EXPECT_EQ(ask(block), (Seen{1, 1}));
}

TEST(SightQueryTest, MasksAndSourcesSelectWhatBlocks) {
  OwnedBlock block = looks({0, 0, 0, 0, 0, 0}, {9, 0, 0});
  block.settings.source = Source::kDynamic;
  block.ignore_groups = {0, 8};
  EXPECT_EQ(ask(block), (Seen{0, 1}));
  block.settings.source = Source::kBoth;
  block.masks = {2, 1};
  EXPECT_EQ(ask(block), (Seen{1, 0}));
}

TEST(SightQueryTest, AnUnanchoredViewerSeesNothing) {
  OwnedBlock block = looks({0, 0, 3, 0, 0, 3}, {6, 0, 3.5f});
  block.anchor_ids = {1, 99};
  EXPECT_EQ(ask(block), (Seen{1, 0}));
}

// There are so many targets that the segments are sorted, and the search of a segment begins with the triangle block
// that blocked a neighbouring segment.
TEST(SightQueryTest, ManyTargetsAreSeenAsByRaysOfModeAny) {
  for (uint64_t seed = 0; seed < scaled_count(40); ++seed) {
    Random random(seed);
    QueryWorld world;
    const StaticMeshPtr city = mesh_of(box_city(6, seed));
    world.instances = {placed(1000, city)};
    if (random.chance(0.5)) world.instances.push_back(placed(1001, mesh_of(bumpy_sphere(6, 0.2, seed)), {20, 20, 5}));
    for (Id id = 1; id <= 20; ++id) world.objects.push_back(ball_object(id, random.vector(60), 1));
    const SnapshotPtr snapshot = snapshot_of(world);
    SightColumns sight;
    sight.samples = static_cast<uint32_t>(random.whole(1, 4));
    OwnedBlock block = looks({}, {}, sight);
    const auto add = [&random](std::vector<float>& points, size_t count) {
      for (; count > 0; --count) {
        const Vec3d point = random.whole_vector(240) * 0.125 + Vec3d{30, 30, 8};
        points.insert(points.end(), {float(point.x), float(point.y), float(point.z)});
      }
    };
    add(block.points, 5);
    add(block.sizes, 80 * sight.samples);
    const std::vector<int> seen = ask(block, snapshot);
    size_t blocked = 0;
    for (size_t viewer = 0; viewer < 5; ++viewer) {
      for (size_t target = 0; target < 80; ++target) {
        int expected = 0;
        for (size_t k = 0; k < sight.samples; ++k) {
          const float *from = &block.points[3 * viewer], *to = &block.sizes[3 * (target * sight.samples + k)];
          // All coordinates are multiples of 1/8, so that floats represent the differences and a ray reaches the sample
          // exactly.
          OwnedBlock ray =
              one_ray(RayMode::kAny, {from[0], from[1], from[2]}, {to[0] - from[0], to[1] - from[1], to[2] - from[2]});
          ray.extras = {1};
          expected += run_block(*snapshot, ray).hits[0] == 0 ? 1 : 0;
        }
        ASSERT_EQ(seen[viewer * 80 + target], expected) << "seed " << seed;
        blocked += expected == 0 ? 1 : 0;
      }
    }
    EXPECT_GT(blocked, 0u);
  }
}

}  // namespace
}  // namespace locus::test
