// The scenes of the proof that no ray misses. Meshes of several kinds and sizes are placed in several ways: unchanged,
// moved, far away, rotated and scaled, and several times in one scene. Immutable; safe from any thread.
#ifndef LOCUS_TESTS_SUPPORT_PROOF_PROOF_SCENES_H_
#define LOCUS_TESTS_SUPPORT_PROOF_PROOF_SCENES_H_

#include <memory>
#include <vector>

#include "tests/support/generated_meshes.h"
#include "tests/support/proof/reference_tree.h"
#include "tests/support/query_world.h"

namespace locus::test {

struct ProofMesh {
  std::vector<Triangle> triangles;
  StaticMeshPtr stored;
  ReferenceTree reference;
  Real extent;         // largest |coordinate| of the mesh
  double size;         // longest side of the mesh's bounds
  double lattice = 0;  // all coordinates are multiples of this number; 0 means no lattice
};

struct ProofInstance {
  Id id;
  std::shared_ptr<const ProofMesh> mesh;
  Transform transform;  // transform as stored in the scene
};

struct ProofScene {
  SnapshotPtr snapshot;
  std::vector<ProofInstance> instances;
};

inline std::shared_ptr<const ProofMesh> proof_mesh(std::vector<Triangle> triangles, double lattice = 0) {
  number_in_order(triangles);
  StaticMeshPtr stored = mesh_of(triangles);
  const Aabbf bounds = stored->bounds();
  ReferenceTree reference(triangles);
  return std::make_shared<const ProofMesh>(ProofMesh{std::move(triangles), std::move(stored), std::move(reference),
                                                     Real{magnitude(bounds)}, double{max_component(bounds.extent())},
                                                     lattice});
}

namespace internal {

// Returns the triangles scaled by `scale`, then moved by `by`. Each coordinate is rounded once, so that closed meshes
// stay closed.
inline std::vector<Triangle> moved(std::vector<Triangle> triangles, double scale, Vec3d by) {
  for (Triangle& triangle : triangles)
    for (Vec3f* vertex : {&triangle.a, &triangle.b, &triangle.c}) *vertex = to_float(to_double(*vertex) * scale + by);
  return triangles;
}

// Returns long thin triangles that cross each other, as thin as 1/100,000 of their length.
inline std::vector<Triangle> slivers(uint32_t count, uint64_t seed) {
  Random random(seed);
  std::vector<Triangle> triangles;
  while (triangles.size() < count) {
    const Vec3d a = random.vector(1), along = random.unit_vector() * random.magnitude(-3, 0);
    const Vec3d across = random.unit_vector() * random.magnitude(-17, -3);
    triangles.push_back({to_float(a), to_float(a + along), to_float(a + along * random.unit() + across)});
  }
  return triangles;
}

// Returns triangles of all sizes that intersect each other; every tenth triangle is a copy of an earlier one.
inline std::vector<Triangle> soup(uint32_t count, uint64_t seed) {
  Random random(seed);
  std::vector<Triangle> triangles;
  while (triangles.size() < count) {
    if (triangles.size() % 10 == 9) {
      triangles.push_back(random.pick(triangles));
      continue;
    }
    const Vec3d a = random.vector(1);
    const double size = random.magnitude(-7, -1);
    triangles.push_back({to_float(a), to_float(a + random.vector(size)), to_float(a + random.vector(size))});
  }
  return triangles;
}

inline std::vector<PlacedMesh> proof_placements(Random& random) {
  std::vector<PlacedMesh> placements(6);
  placements[1].translation = {1'024, -2'048, 512.5};
  placements[2].translation = {1'048'576, -999'424, 524'288};
  placements[3].translation = random.vector(100);
  placements[4].translation = random.vector(1e6);
  placements[4].scale = 1e-3f;
  placements[5].translation = random.vector(1e6);
  placements[5].scale = 1e3f;
  for (size_t i = 3; i < placements.size(); ++i) placements[i].rotation = random.rotation();
  return placements;
}

inline std::vector<PlacedMesh> three_through_each_other(double size, Random& random) {
  std::vector<PlacedMesh> three(3);
  three[1].translation = random.vector(size / 2);
  three[2].translation = random.vector(size / 2);
  three[2].rotation = random.rotation();
  three[2].scale = 0.75f;
  return three;
}

// Returns 20 overlapping placements of a mesh. A ray meets several instances, and their order by bounds along the ray
// can differ from their order by hits.
inline std::vector<PlacedMesh> many_all_over(double size, Random& random) {
  std::vector<PlacedMesh> many(20);
  for (PlacedMesh& placed : many) {
    placed.translation = random.vector(2 * size);
    if (random.chance(0.7)) placed.rotation = random.rotation();
    placed.scale = static_cast<float>(random.magnitude(-2, 1));
  }
  return many;
}

inline ProofScene proof_scene(const std::shared_ptr<const ProofMesh>& mesh, std::vector<PlacedMesh> placements) {
  QueryWorld world;
  for (size_t i = 0; i < placements.size(); ++i) {
    placements[i].id = static_cast<Id>(i + 1);
    placements[i].mesh = mesh->stored;
  }
  world.instances = std::move(placements);
  ProofScene scene{snapshot_of(world), {}};
  for (const PlacedMesh& placed : world.instances)
    scene.instances.push_back({placed.id, mesh, scene.snapshot->statics->find(placed.id)->transform});
  return scene;
}

}  // namespace internal

inline std::vector<std::shared_ptr<const ProofMesh>> proof_meshes(uint64_t seed) {
  const std::vector<Triangle> city = box_city(18, seed), sphere = bumpy_sphere(32, 0.1, seed);
  return {proof_mesh(city, 0.5),
          proof_mesh(internal::moved(box_city(6, seed + 1), 1.0 / 512, {}), 1.0 / 1024),
          proof_mesh(internal::moved(city, 1, {65'536, -131'072, 32'768}), 0.5),
          proof_mesh(sphere),
          proof_mesh(internal::moved(sphere, 1e-3, {})),
          proof_mesh(internal::moved(sphere, 1e3, {20'000, 0, -50'000})),
          proof_mesh(internal::slivers(2'000, seed)),
          proof_mesh(internal::soup(4'000, seed)),
          proof_mesh(bumpy_sphere(100, 0.02, seed))};
}

// Returns for every mesh a scene for each placement, a scene of three intersecting instances and a scene of many
// instances.
inline std::vector<ProofScene> proof_scenes(uint64_t seed) {
  Random random(seed);
  std::vector<ProofScene> scenes;
  for (const std::shared_ptr<const ProofMesh>& mesh : proof_meshes(seed)) {
    for (const PlacedMesh& placement : internal::proof_placements(random))
      scenes.push_back(internal::proof_scene(mesh, {placement}));
    scenes.push_back(internal::proof_scene(mesh, internal::three_through_each_other(mesh->size, random)));
    scenes.push_back(internal::proof_scene(mesh, internal::many_all_over(mesh->size, random)));
  }
  return scenes;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_PROOF_PROOF_SCENES_H_
