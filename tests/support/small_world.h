// A few triangles and objects with whole coordinates, so that the answers to queries are easy to derive. Used by tests
// of queries.
#ifndef LOCUS_TESTS_SUPPORT_SMALL_WORLD_H_
#define LOCUS_TESTS_SUPPORT_SMALL_WORLD_H_

#include <vector>

#include "tests/support/owned_block.h"
#include "tests/support/query_world.h"

namespace locus::test {

inline Object point_object(Id id, Vec3d position) {
  Object object;
  object.id = id;
  object.shape.position = position;
  return object;
}

inline Object ball_object(Id id, Vec3d position, float radius = 1) {
  Object object;
  object.id = id;
  object.shape.kind = ShapeKind::kBall;
  object.shape.position = position;
  object.shape.radius = radius;
  return object;
}

inline Object box_object(Id id, Vec3d position, Vec3f half = {1, 1, 1}) {
  Object object;
  object.id = id;
  object.shape.kind = ShapeKind::kBox;
  object.shape.position = position;
  object.shape.size = half;
  return object;
}

// Returns a triangle that is perpendicular to the x axis and intersects this axis at `x`. Its front faces +x.
inline Triangle wall_triangle(float x) { return {{x, -8, -8}, {x, 8, -8}, {x, 0, 8}}; }
inline Triangle turned_over(const Triangle& triangle) { return {triangle.a, triangle.c, triangle.b, triangle.number}; }

inline PlacedMesh placed(Id id, StaticMeshPtr mesh, Vec3d translation = {}) {
  PlacedMesh result;
  result.id = id;
  result.mesh = std::move(mesh);
  result.translation = translation;
  return result;
}

// Returns a mesh of one wall_triangle() at x = 0 in mesh axes.
inline StaticMeshPtr wall_mesh() { return mesh_of({wall_triangle(0)}); }

// Returns the mesh of a cube from -1 to 1 in mesh axes: six faces of two triangles each.
inline StaticMeshPtr cube_mesh() {
  std::vector<Triangle> triangles;
  for (int axis = 0; axis < 3; ++axis)
    for (const float side : {-1.0f, 1.0f}) {
      const auto corner = [&](float first, float second) {
        Vec3f vertex;
        vertex[axis] = side;
        vertex[(axis + 1) % 3] = first;
        vertex[(axis + 2) % 3] = second;
        return vertex;
      };
      triangles.push_back({corner(-1, -1), corner(1, -1), corner(1, 1)});
      triangles.push_back({corner(-1, -1), corner(1, 1), corner(-1, 1)});
    }
  return mesh_of(triangles);
}

// Returns rays of mode `mode` from `origins` in the direction of the x axis.
inline OwnedBlock rays_along_x(RayMode mode, std::vector<float> origins = {0, 0, 0}) {
  OwnedBlock block;
  RayColumns rays;
  rays.mode = mode;
  block.settings.kind = rays;
  block.points = std::move(origins);
  block.sizes = {1, 0, 0};
  return block;
}

inline OwnedBlock one_ray(RayMode mode, Vec3f origin, Vec3f direction) {
  OwnedBlock block = rays_along_x(mode, {origin.x, origin.y, origin.z});
  block.sizes = {direction.x, direction.y, direction.z};
  return block;
}

inline RayColumns& rays_of(OwnedBlock& block) { return std::get<RayColumns>(block.settings.kind); }

inline OwnedBlock one_ball(Vec3f center, float radius, StaticDetail detail = StaticDetail::kInstances) {
  OwnedBlock block;
  block.settings.kind = BallColumns{{}, {}, detail};
  block.points = {center.x, center.y, center.z};
  block.sizes = {radius};
  return block;
}

inline OwnedBlock one_box(Vec3f center, Vec3f half, StaticDetail detail = StaticDetail::kInstances) {
  OwnedBlock block;
  block.settings.kind = BoxColumns{{}, {}, {}, detail};
  block.points = {center.x, center.y, center.z};
  block.sizes = {half.x, half.y, half.z};
  return block;
}

// Returns a query for the `count` nearest values to one point.
inline OwnedBlock one_point(Vec3f point, uint32_t count = 0, StaticDetail detail = StaticDetail::kInstances) {
  OwnedBlock block;
  block.settings.kind = NearestColumns{{}, {}, count, detail};
  block.points = {point.x, point.y, point.z};
  return block;
}

inline OwnedBlock lookup_of_ids(std::vector<uint64_t> ids) {
  OwnedBlock block;
  block.settings.kind = LookupColumns{};
  block.ids = std::move(ids);
  return block;
}

inline OwnedBlock lookup_of_groups(std::vector<uint64_t> groups) {
  OwnedBlock block;
  block.settings.kind = LookupColumns{};
  block.groups = std::move(groups);
  return block;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_SMALL_WORLD_H_
