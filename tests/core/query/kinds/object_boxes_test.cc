#include "core/query/kinds/object_boxes.h"

#include <gtest/gtest.h>

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/query/kinds/query_task.h"
#include "tests/support/random_shape.h"
#include "tests/support/small_world.h"

namespace locus::test {
namespace {

// Makes objects of all shapes in a cube of side 2 `size` around `center`.
QueryWorld world_of_objects(Random& random, int count, double size, Vec3d center) {
  QueryWorld world;
  for (int i = 0; i < count; ++i) {
    Object object;
    object.id = static_cast<Id>(i + 1);
    object.layers = random.chance(0.5) ? kDefaultLayers : 2u;
    object.shape = random_shape(random, random.pick(kShapeKinds), size);
    object.shape.position = center + random.vector(size);
    world.objects.push_back(object);
  }
  return world;
}

// Makes fans of sixteen rays, each from one point, with limits that may end a ray in the middle of the objects. Some
// fans start on an object or lie in a plane of two axes.
OwnedBlock fans(Random& random, RayMode mode, const QueryWorld& world, double size, Vec3d center, int count) {
  OwnedBlock block = rays_along_x(mode, {});
  block.sizes.clear();
  for (int fan = 0; fan < count; ++fan) {
    const Vec3d origin =
        random.chance(0.3) ? random.pick(world.objects).shape.position : center + random.vector(2 * size);
    const Vec3d ahead = random.pick(world.objects).shape.position - origin + random.vector(size * 0.01);
    const double width = max_component(abs(ahead)) * random.magnitude(-20, -2);
    const int flat_axis = random.chance(0.2) ? random.whole(0, 2) : 3;
    for (size_t ray = 0; ray < RayBeam::kRays; ++ray) {
      Vec3d direction = ahead + random.vector(width);
      if (flat_axis < 3) direction[flat_axis] = 0;
      if (direction == Vec3d{}) direction.x = 1;
      for (int axis = 0; axis < 3; ++axis) {
        block.points.push_back(static_cast<float>(origin[axis]));
        block.sizes.push_back(static_cast<float>(direction[axis]));
      }
      block.extras.push_back(random.chance(0.5) ? static_cast<float>(random.between(0, 2))
                                                : std::numeric_limits<float>::infinity());
    }
  }
  return block;
}

void expect_answers_of_all_objects(Random& random, const QueryWorld& world, double size, Vec3d center) {
  const SnapshotPtr snapshot = snapshot_of(world);
  RunOptions brute_force;
  brute_force.brute_force = true;
  for (const RayMode mode : {RayMode::kFirst, RayMode::kAny, RayMode::kAll}) {
    OwnedBlock block = fans(random, mode, world, size, center, 40);
    if (random.chance(0.5)) block.masks = {2u};
    const BlockResult found = run_block(*snapshot, block), expected = run_block(*snapshot, block, brute_force);
    EXPECT_EQ(found.ids, expected.ids);
    EXPECT_EQ(found.t, expected.t);
    EXPECT_EQ(found.hits, expected.hits);
    EXPECT_EQ(found.counts, expected.counts);
    EXPECT_EQ(found.truncated, expected.truncated);
  }
}

TEST(ObjectBoxesTest, FansOfRaysHitTheObjectsThatATestOfAllObjectsHits) {
  for (uint64_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const double size = random.magnitude(-3, 12);
    const Vec3d center = random.chance(0.5) ? Vec3d{} : random.vector(size * random.magnitude(0, 12));
    expect_answers_of_all_objects(random, world_of_objects(random, random.whole(1, 200), size, center), size, center);
  }
}

TEST(ObjectBoxesTest, ABeamFindsOnlyBoxesBesideIt) {
  QueryWorld world;
  for (int x = 0; x < 40; ++x)
    for (int y = 0; y < 40; ++y)
      world.objects.push_back(ball_object(static_cast<Id>(40 * x + y + 1), {x * 10.0, y * 10.0, 0}));
  const SnapshotPtr snapshot = snapshot_of(world);
  const ObjectBoxes boxes(snapshot->objects);
  const auto direction = [](size_t i) { return Vec3d{1, 0.001 * double(i), 0}; };
  const std::optional<RayBeam> beam = RayBeam::of({-10, 0, 0}, direction);
  ASSERT_TRUE(beam);
  std::vector<ObjectBoxes::Found> found;
  Work work;
  boxes.find(*beam, beam->depth(direction(0), 105), found, work);
  EXPECT_EQ(found.size(), 10u);  // the balls at x = 0, 10 .. 90
  for (size_t i = 1; i < found.size(); ++i) EXPECT_LE(found[i - 1].depth, found[i].depth);
  EXPECT_LT(work.cells, 40u);
}

TEST(ObjectBoxesTest, RaysInDifferentDirectionsAreNoBeam) {
  const auto turned = [](size_t i) { return Vec3d{1, i == 9 ? 0.9 : 0.0, 0}; };
  const auto reversed = [](size_t i) { return Vec3d{i == 15 ? -1.0 : 1.0, 0, 0}; };
  const auto along = [](size_t i) { return Vec3d{0.1, 0.1, -1 - double(i)}; };
  EXPECT_FALSE(RayBeam::of({}, turned));
  EXPECT_FALSE(RayBeam::of({}, reversed));
  EXPECT_TRUE(RayBeam::of({}, along));
}

TEST(ObjectBoxesTest, ABatchBuildsBoxesOnceItHasManyRaysForItsObjects) {
  QueryWorld world;
  for (Id id = 1; id <= 100; ++id) world.objects.push_back(ball_object(id, {5.0 * double(id), 0, 0}));
  const SnapshotPtr snapshot = snapshot_of(world);
  BatchControl control(0, {});
  for (int call = 0; call < 3; ++call) EXPECT_EQ(control.object_boxes(snapshot->objects, 16), nullptr);
  const ObjectBoxes* const boxes = control.object_boxes(snapshot->objects, 16);
  EXPECT_NE(boxes, nullptr);
  EXPECT_EQ(control.object_boxes(snapshot->objects, 16), boxes);
}

}  // namespace
}  // namespace locus::test
