#include "tests/bench/structures/scenes.h"

#include <cmath>

#include "tests/support/random.h"

namespace locus::bench::structures {
namespace {

using test::Random;

constexpr double kSpacing = 4;  // of a uniform scene

Object box_of(uint64_t id, const Vec3d& center, const Vec3f& half) {
  Object box;
  box.id = id;
  box.shape.kind = ShapeKind::kBox;
  box.shape.position = center;
  box.shape.size = half;
  return box;
}

Vec3d point_in(Random& random, double side) {
  return {random.between(0.0, side), random.between(0.0, side), random.between(0.0, side)};
}

Scene uniform_scene(SceneKind kind, uint32_t count) {
  Random random(1);
  Scene scene;
  scene.spacing = kSpacing;
  const double side = kSpacing * std::cbrt(count);
  for (uint32_t i = 0; i < count; ++i) {
    const bool in_hub = kind == SceneKind::kHub && i % 2 == 0;
    const double extent = in_hub ? side / 20 : side;
    scene.boxes.push_back(box_of(i + 1, point_in(random, extent), {0.5f, 0.5f, 0.5f}));
  }
  if (kind == SceneKind::kGiant) {
    const float half = static_cast<float>(side / 2);
    scene.boxes.front() = box_of(1, {side / 2, side / 2, side / 2}, {half, half, half});
  }
  return scene;
}

Scene city(double spacing, uint32_t count) {
  Random random(2);
  Scene scene;
  scene.spacing = spacing;
  const uint32_t side = static_cast<uint32_t>(std::ceil(std::sqrt(count)));
  for (uint32_t i = 0; i < count; ++i) {
    const double height = random.between(0.1, 1.5) * spacing;
    const Vec3d center = {(i % side + 0.5) * spacing, (i / side + 0.5) * spacing, height};
    const float half = static_cast<float>(0.35 * spacing);
    scene.boxes.push_back(box_of(i + 1, center, {half, half, static_cast<float>(height)}));
  }
  return scene;
}

}  // namespace

const char* name_of(SceneKind kind) {
  switch (kind) {
    case SceneKind::kUniform:
      return "uniform";
    case SceneKind::kHub:
      return "hub";
    case SceneKind::kCity1:
      return "city1";
    case SceneKind::kCity100:
      return "city100";
    case SceneKind::kGiant:
      break;
  }
  return "giant";
}

Scene scene_of(SceneKind kind, uint32_t count) {
  if (kind == SceneKind::kCity1) return city(1, count);
  if (kind == SceneKind::kCity100) return city(100, count);
  return uniform_scene(kind, count);
}

SceneQueries queries_of(const Scene& scene, size_t count) {
  Random random(3);
  SceneQueries queries;
  queries.short_length = 2 * scene.spacing;
  for (size_t i = 0; i < count; ++i) {
    // Every box is chosen with the same probability, but never the giant box, which is the first.
    const Object& near = scene.boxes[1 + random.below(scene.boxes.size() - 1)];
    Vec3d at = near.shape.position;
    for (int axis = 0; axis < 3; ++axis) at[axis] += random.between(-0.5, 0.5) * scene.spacing;
    Vec3d direction = {random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-0.2, 0.2)};
    direction = direction * (1 / std::sqrt(dot(direction, direction)));
    queries.rays.emplace_back(Rayd{at, direction});
    queries.balls.push_back({at, scene.spacing});
    const double half = scene.spacing;
    queries.boxes.push_back({.center = at, .half = {half, half, half}, .rotation = {}});
    queries.points.push_back(at);
  }
  return queries;
}

}  // namespace locus::bench::structures
