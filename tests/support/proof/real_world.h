// A random scene in long double: the triangles of one placed mesh, and balls, capsules and points around the mesh. Used
// by proofs that compare the answers of queries with distances in long double. Shares only vectors and the placement as
// stored with the product.
#ifndef LOCUS_TESTS_SUPPORT_PROOF_REAL_WORLD_H_
#define LOCUS_TESTS_SUPPORT_PROOF_REAL_WORLD_H_

#include <string>
#include <vector>

#include "tests/support/generated_meshes.h"
#include "tests/support/proof/real_sweep.h"
#include "tests/support/small_world.h"
#include "tests/support/triangle_reference.h"

namespace locus::test {

// Returns a sphere, houses, or 60 random triangles, among them slivers and triangles without area.
inline std::vector<Triangle> random_proof_mesh(Random& random) {
  const uint64_t seed = random.next();
  if (random.chance(0.3)) return bumpy_sphere(6, 0.3, seed);
  if (random.chance(0.3)) return box_city(3, seed);
  std::vector<Triangle> mesh;
  const Vec3f home = to_float(random.vector(4));
  while (mesh.size() < 60) {
    const Triangle t = random_triangle(random);
    const float scale = static_cast<float>(2 / std::max(size_of(t), 1e-6));
    const Vec3f place = home + to_float(random.vector(4));
    mesh.push_back({(t.a - t.a) * scale + place, (t.b - t.a) * scale + place, (t.c - t.a) * scale + place});
  }
  number_in_order(mesh);
  return mesh;
}

// Returns a random placement of the mesh with the id 1: unchanged, or rotated, scaled and moved.
inline PlacedMesh random_proof_placement(const std::vector<Triangle>& mesh, Random& random) {
  PlacedMesh placed;
  placed.id = 1;
  placed.mesh = mesh_of(mesh);
  if (random.chance(0.7)) {
    placed.rotation = random.rotation();
    placed.scale = static_cast<float>(random.magnitude(-4, 4));
    placed.translation = random.vector(random.magnitude(0, 16));
  }
  return placed;
}

// Solid of all points within `radius` of the segment center - half_axis .. center + half_axis. A ball has no half axis,
// a point has no radius either.
struct RealSolid {
  Id id = kNoId;
  ShapeKind kind = ShapeKind::kPoint;
  Vec3r center, half_axis;
  Real radius = 0;

  Real size() const { return radius + length(half_axis); }
};

// Returns the distance between the surfaces of two solids; negative if they overlap: the distance of their segments
// minus both radii.
inline Real gap_between(const RealSolid& a, const RealSolid& b) {
  return segment_distance(a.center - a.half_axis, a.half_axis * 2, b.center - b.half_axis, b.half_axis * 2) - a.radius -
         b.radius;
}

class RealWorld {
 public:
  explicit RealWorld(uint64_t seed, size_t objects = 40)
      : seed_(seed), random_(seed), mesh_(random_proof_mesh(random_)) {
    QueryWorld world;
    world.instances = {random_proof_placement(mesh_, random_)};
    for (Id id = 2; id < 2 + objects; ++id) world.objects.push_back(random_object(id, world.instances[0]));
    snapshot_ = snapshot_of(world);
    transform_ = &snapshot_->statics->find(1)->transform;
    for (const Triangle& triangle : mesh_) {
      corners_.push_back({world_of(triangle.a), world_of(triangle.b), world_of(triangle.c)});
      triangles_.emplace_back(corners_.back());
    }
    for (const Object& object : world.objects) {
      const Shape& shape = object.shape;
      RealSolid solid{object.id, shape.kind, to_real(shape.position), {}, 0};
      if (shape.kind != ShapeKind::kPoint) solid.radius = shape.radius;
      if (shape.kind == ShapeKind::kCapsule) solid.half_axis = turned(shape.rotation, to_real(shape.size));
      solids_.push_back(solid);
    }
  }

  uint64_t seed() const { return seed_; }
  Random& random() { return random_; }
  const SceneSnapshot& snapshot() const { return *snapshot_; }
  // Return the triangles of the mesh, in mesh axes, and their placement.
  const std::vector<Triangle>& mesh() const { return mesh_; }
  const Transform& transform() const { return *transform_; }
  // Returns the position of the mesh, used as the frame of queries, and its scale.
  Vec3d frame() const { return transform_->translation; }
  double scale() const { return transform_->scale; }
  const std::vector<RealCorners>& corners() const { return corners_; }
  const std::vector<SweptTriangle>& triangles() const { return triangles_; }
  const std::vector<RealSolid>& solids() const { return solids_; }

  // Returns a random point near a triangle, relative to frame(). Most points are within 2^-7 to 2^1 of a triangle.
  Vec3f point_near_a_triangle() {
    const Triangle& target = random_.pick(mesh_);
    const double u = random_.unit(), v = random_.unit() * (1 - u);
    const Vec3d at = to_double(target.a) * (1 - u - v) + to_double(target.b) * u + to_double(target.c) * v;
    return to_float(transform_->point_to_world(at) - frame() + random_.vector(scale() * random_.magnitude(-7, 2)));
  }
  // Returns a position that the query's float offset from frame() stands for.
  Vec3r real_point(const float* offset) const { return to_real(frame()) + Vec3r{offset[0], offset[1], offset[2]}; }
  // Returns the distance between a triangle and the segment of `solid`, without its radius.
  Real distance_to_segment(size_t triangle, const RealSolid& solid) const {
    RealMover mover;
    mover.start = solid.center;
    mover.half_axis = solid.half_axis;
    return triangles_[triangle].gap(mover, 0, 0);
  }
  // Returns the largest difference between an answer and the reference that rounding may explain, for a query of this
  // size at this place.
  // Positions in world axes are double, sizes and the offsets from frame() are float.
  Real allowance(Vec3r place, Real size) const {
    const Real near = length(place - to_real(frame())) + size + 8 * Real{scale()};
    return 0x1p-40L * length(place) + 0x1p-20L * near;
  }

 private:
  Vec3r world_of(Vec3f corner) const {
    return turned(transform_->quaternion, to_real(corner)) * Real{transform_->scale} + to_real(transform_->translation);
  }
  Object random_object(Id id, const PlacedMesh& placed) {
    Object object = point_object(id, placed.translation + random_.vector(8 * double{placed.scale}));
    object.shape.kind = random_.pick(std::vector<ShapeKind>{ShapeKind::kPoint, ShapeKind::kBall, ShapeKind::kCapsule});
    if (object.shape.kind != ShapeKind::kPoint)
      object.shape.radius = placed.scale * static_cast<float>(random_.magnitude(-6, 1));
    if (object.shape.kind != ShapeKind::kCapsule) return object;
    object.shape.rotation = random_.rotation();
    object.shape.size = to_float(random_.vector(2 * double{placed.scale}));
    return object;
  }

  const uint64_t seed_;
  Random random_;
  const std::vector<Triangle> mesh_;
  SnapshotPtr snapshot_;
  const Transform* transform_ = nullptr;
  std::vector<RealCorners> corners_;
  std::vector<SweptTriangle> triangles_;
  std::vector<RealSolid> solids_;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_PROOF_REAL_WORLD_H_
