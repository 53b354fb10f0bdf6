// A small scene and queries on it, in double and independent of the type of the indexed values. make_scene() converts a
// sketch into triangles or into objects, so that every index is tested on the same situations.
#ifndef LOCUS_TESTS_SUPPORT_SCENE_SKETCH_H_
#define LOCUS_TESTS_SUPPORT_SCENE_SKETCH_H_

#include <algorithm>
#include <concepts>
#include <string>
#include <vector>

#include "core/scene/objects/object.h"
#include "tests/support/random.h"

namespace locus::test {

// Position, half extents and rotation of one item of a sketch, which becomes an object or a few triangles. Walls, lines
// and points have half extents of zero on one, two or three axes.
struct Placement {
  Vec3d center;
  Vec3d half;
  Quaternion rotation;
};

struct SceneSketch {
  std::string family;
  std::vector<Placement> placements;
  std::vector<Rayd> rays;  // their t_max is not used
  std::vector<Balld> balls;
  std::vector<Obbd> boxes;
};

template <Primitive V>
struct TestScene {
  using Traits = PrimitiveTraits<V>;

  std::string name;
  std::vector<V> values;  // values with unique ids, in any order
  std::vector<typename Traits::RayQuery> rays;
  std::vector<typename Traits::BallQuery> balls;
  std::vector<typename Traits::BoxQuery> boxes;
};

namespace internal {

inline void append_quad(std::vector<Triangle>& triangles, Vec3d a, Vec3d b, Vec3d c, Vec3d d) {
  triangles.push_back({to_float(a), to_float(b), to_float(c)});
  triangles.push_back({to_float(a), to_float(c), to_float(d)});
}

// Appends two triangles that form a rectangle. `center` is the rectangle's centre and `axis` is perpendicular to the
// rectangle; both refer to the axes of the placement.
inline void append_wall(std::vector<Triangle>& triangles, const Placement& placement, Vec3d center, int axis) {
  const Rotation rotation = rotation_of(placement.rotation);
  Vec3d u, v;
  u[(axis + 1) % 3] = placement.half[(axis + 1) % 3];
  v[(axis + 2) % 3] = placement.half[(axis + 2) % 3];
  const auto at = [&](Vec3d local) { return placement.center + rotation.to_world(center + local); };
  append_quad(triangles, at(-u - v), at(u - v), at(u + v), at(v - u));
}

inline void append_closed_box(std::vector<Triangle>& triangles, const Placement& placement) {
  for (int axis = 0; axis < 3; ++axis) {
    Vec3d side;
    side[axis] = placement.half[axis];
    append_wall(triangles, placement, side, axis);
    append_wall(triangles, placement, -side, axis);
  }
}

// Appends the triangles of a placement. A flat placement becomes a rectangle of two triangles, which may have no area.
// Any other placement becomes a closed box, or a single triangle within the unrotated box.
inline void append_triangles(std::vector<Triangle>& triangles, const Placement& placement, Random& random) {
  const Vec3d h = placement.half;
  if (h.x == 0 || h.y == 0 || h.z == 0) {
    append_wall(triangles, placement, {}, h.x == 0 ? 0 : h.y == 0 ? 1 : 2);
  } else if (random.chance(0.3)) {
    append_closed_box(triangles, placement);
  } else {
    const auto corner = [&] {
      const Vec3d local = {random.between(-h.x, h.x), random.between(-h.y, h.y), random.between(-h.z, h.z)};
      return to_float(placement.center + local);
    };
    triangles.push_back({corner(), corner(), corner()});
  }
}

inline Object make_object(const Placement& placement, Random& random) {
  Object object;
  object.shape.position = placement.center;
  object.shape.rotation = placement.rotation;
  const Vec3f half = to_float(placement.half);
  const uint64_t kind = random.below(8);
  if (kind == 0 || max_component(half) == 0) {
    object.shape.kind = ShapeKind::kPoint;
  } else if (kind <= 2) {
    object.shape.kind = ShapeKind::kBall;
    object.shape.radius = max_component(half);
  } else if (kind <= 4) {
    object.shape.kind = ShapeKind::kCapsule;
    object.shape.size = {half.x, 0, 0};
    object.shape.radius = half.y;
  } else {
    object.shape.kind = ShapeKind::kBox;
    object.shape.size = half;
  }
  return object;
}

// Returns ids in random order, so that a lower id does not imply an earlier position.
inline std::vector<uint32_t> shuffled_ids(size_t count, Random& random) {
  std::vector<uint32_t> ids;
  for (size_t i = 0; i < count; ++i) ids.push_back(static_cast<uint32_t>(i + 1));
  random.shuffle(ids);
  return ids;
}

inline void fill(const SceneSketch& sketch, Random& random, TestScene<Triangle>& scene) {
  for (const Placement& placement : sketch.placements) append_triangles(scene.values, placement, random);
  const std::vector<uint32_t> ids = shuffled_ids(scene.values.size(), random);
  for (size_t i = 0; i < ids.size(); ++i) scene.values[i].number = ids[i];
  for (const Rayd& ray : sketch.rays) {
    const uint64_t cull = random.below(8);
    scene.rays.emplace_back(ray.origin, ray.direction,
                            cull == 0   ? Cull::kBack
                            : cull == 1 ? Cull::kFront
                                        : Cull::kNone);
  }
  for (const Balld& ball : sketch.balls)
    scene.balls.push_back({to_float(ball.center), static_cast<float>(ball.radius)});
  for (const Obbd& box : sketch.boxes) scene.boxes.push_back({to_float(box.center), to_float(box.half), box.rotation});
}

inline void fill(const SceneSketch& sketch, Random& random, TestScene<Object>& scene) {
  const std::vector<uint32_t> ids = shuffled_ids(sketch.placements.size(), random);
  for (size_t i = 0; i < ids.size(); ++i) {
    scene.values.push_back(make_object(sketch.placements[i], random));
    scene.values.back().id = ids[i];
  }
  for (const Rayd& ray : sketch.rays) {
    const uint64_t inside = random.below(4);
    scene.rays.emplace_back(ray, inside == 0 ? Inside::kHollow : inside == 1 ? Inside::kSkip : Inside::kSolid);
  }
  scene.balls = sketch.balls;
  scene.boxes = sketch.boxes;
}

}  // namespace internal

// Converts a sketch into a scene of values of type V, Triangle or Object.
template <Primitive V>
TestScene<V> make_scene(const SceneSketch& sketch, Random& random) {
  TestScene<V> scene;
  scene.name = sketch.family;
  internal::fill(sketch, random, scene);
  return scene;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_SCENE_SKETCH_H_
