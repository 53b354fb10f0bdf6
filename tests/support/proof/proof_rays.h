// Rays for the proof that no ray passes through a mesh without a hit: random rays; rays aimed at the interiors, edges
// and corners of triangles; rays that start on triangles, graze triangles or start far away; and, for meshes whose
// vertices lie on a lattice, rays that start at a lattice point, usually in the plane of a wall, and run along an axis
// or a diagonal. The rays depend only on the state of the random generator.
#ifndef LOCUS_TESTS_SUPPORT_PROOF_PROOF_RAYS_H_
#define LOCUS_TESTS_SUPPORT_PROOF_PROOF_RAYS_H_

#include <limits>

#include "tests/support/adversarial_scenes.h"
#include "tests/support/proof/proof_scenes.h"
#include "tests/support/small_world.h"

namespace locus::test {

namespace internal {

// A ray in mesh axes.
struct MeshRay {
  Vec3d origin, target;
};

inline Vec3d point_in(const Triangle& triangle, double u, double v) {
  return to_double(triangle.a) * (1 - u - v) + to_double(triangle.b) * u + to_double(triangle.c) * v;
}

inline Vec3d inner_point(const Triangle& triangle, Random& random) {
  const double u = random.unit();
  return point_in(triangle, u, random.unit() * (1 - u));
}

// Returns the first corner, or a point of the edge between the first and the second corner.
inline Vec3d boundary_point(const Triangle& triangle, Random& random) {
  return random.chance(0.3) ? to_double(triangle.a) : point_in(triangle, random.chance(0.3) ? 0.5 : random.unit(), 0);
}

inline Vec3d point_around(const ProofMesh& mesh, double share, Random& random) {
  const Aabbf bounds = mesh.stored->bounds();
  Vec3d point;
  for (int axis = 0; axis < 3; ++axis)
    point[axis] = random.between(bounds.min[axis] - share * mesh.size, bounds.max[axis] + share * mesh.size);
  return point;
}

inline MeshRay random_ray(const ProofMesh& mesh, Random& random) {
  const Vec3d origin = point_around(mesh, 0.1, random);
  return {origin, origin + random.unit_vector() * mesh.size};
}

inline MeshRay aimed_ray(const ProofMesh& mesh, Random& random) {
  return {point_around(mesh, 0.5, random), inner_point(random.pick(mesh.triangles), random)};
}

inline MeshRay boundary_ray(const ProofMesh& mesh, Random& random) {
  return {point_around(mesh, 0.2, random), boundary_point(random.pick(mesh.triangles), random)};
}

inline MeshRay surface_ray(const ProofMesh& mesh, Random& random) {
  const Triangle& triangle = random.pick(mesh.triangles);
  const Vec3d origin = random.chance(0.3) ? boundary_point(triangle, random) : inner_point(triangle, random);
  if (random.chance(0.5)) return {origin, origin + random.unit_vector() * mesh.size};
  return {origin, inner_point(random.pick(mesh.triangles), random)};
}

// Generates a ray that is nearly in the triangle's plane, down to a slope of a millionth.
inline MeshRay grazing_ray(const ProofMesh& mesh, Random& random) {
  const Triangle& triangle = random.pick(mesh.triangles);
  const Vec3d from = inner_point(triangle, random), to = inner_point(triangle, random);
  const Vec3d off = random.unit_vector() * std::sqrt(squared_length(to - from)) * random.magnitude(-20, -2);
  return {from - (to - from) * random.between(0, 3) + off, to};
}

inline MeshRay far_ray(const ProofMesh& mesh, Random& random) {
  const Vec3d target = inner_point(random.pick(mesh.triangles), random);
  return {target + random.unit_vector() * mesh.size * random.magnitude(0, 10), target};
}

// Generates a ray from a point of the lattice, usually on a wall's plane, along an axis or a diagonal.
inline MeshRay lattice_ray(const ProofMesh& mesh, Random& random) {
  if (mesh.lattice == 0) return boundary_ray(mesh, random);
  const Vec3d corner = to_double(random.pick(mesh.triangles).a);
  Vec3d origin = corner + random.whole_vector(60) * mesh.lattice;
  if (random.chance(0.6)) {
    const int axis = static_cast<int>(random.below(3));
    origin[axis] = corner[axis];
  }
  return {origin, origin + lattice_direction(random) * mesh.lattice};
}

using RayFamily = MeshRay (*)(const ProofMesh&, Random&);
inline constexpr RayFamily kRayFamilies[] = {random_ray,  random_ray,  aimed_ray, boundary_ray, boundary_ray,
                                             surface_ray, grazing_ray, far_ray,   lattice_ray,  lattice_ray};

inline void add_ray(const ProofInstance& instance, const MeshRay& ray, Random& random, OwnedBlock& block) {
  const Vec3d frame = block.settings.frame;
  constexpr double kFarthest = 9e8;  // near the limit of coordinates
  const Vec3d from = instance.transform.point_to_world(ray.origin);
  const Vec3d within = max(min(from, {kFarthest, kFarthest, kFarthest}), {-kFarthest, -kFarthest, -kFarthest});
  const Vec3f origin = to_float(within - frame);
  const Vec3d target = instance.transform.point_to_world(ray.target) - frame;
  const double longer = random.chance(0.5) ? 1 : random.magnitude(-12, 12);
  Vec3f direction = to_float((target - to_double(origin)) * longer);
  if (random.chance(0.05)) direction[static_cast<int>(random.below(3))] = 0;
  if (direction == Vec3f{}) direction = {0, 0, 1};
  float t_max = std::numeric_limits<float>::infinity();
  if (random.chance(0.3)) t_max = static_cast<float>(random.between(0, 2) / longer);
  block.points.insert(block.points.end(), {origin.x, origin.y, origin.z});
  block.sizes.insert(block.sizes.end(), {direction.x, direction.y, direction.z});
  block.extras.push_back(t_max);
}

}  // namespace internal

// Length of a run of rays in nearly equal directions, which the kernels trace as packets. One block in four contains
// such runs.
inline constexpr size_t kBeamRays = 24;

// Generates `count` rays from the families in turn. Origins are floats relative to the block's frame. In three of four
// blocks the frame is at the position of an instance, in the other blocks up to a kilometre from this position on each
// axis. The reference uses the rounded values in the block.
inline OwnedBlock proof_rays(const ProofScene& scene, size_t count, Random& random) {
  OwnedBlock block = rays_along_x(RayMode::kFirst, {});
  block.sizes.clear();
  const Vec3d center = random.pick(scene.instances).transform.translation;
  block.settings.frame = random.chance(0.75) ? center : center + random.vector(1e3);
  if (random.chance(0.3)) rays_of(block).cull = random.chance(0.5) ? Cull::kBack : Cull::kFront;
  const size_t beam = random.chance(0.25) ? kBeamRays : 1;
  const ProofInstance* instance = nullptr;
  internal::MeshRay ray{};
  for (size_t i = 0; i < count; ++i) {
    if (i % beam == 0) {
      instance = &random.pick(scene.instances);
      ray = internal::kRayFamilies[i / beam % std::size(internal::kRayFamilies)](*instance->mesh, random);
    } else {
      ray.target = ray.target + random.vector(instance->mesh->size * random.magnitude(-16, -8));
    }
    internal::add_ray(*instance, ray, random, block);
  }
  return block;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_PROOF_PROOF_RAYS_H_
