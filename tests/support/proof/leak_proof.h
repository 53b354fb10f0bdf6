// The proof that no ray leaves a closed mesh. Rays start inside the mesh and are aimed at its corners and edges. The
// server's query engine traces each ray with every instruction set, for the first hit, any hit and all hits. One
// thread.
//
// Precision of the aim: a request contains, as floats, the direction of a ray and the offset of its origin from the
// frame. So the position inside the mesh is rounded twice: the offset to float, and frame + offset to double. The
// direction is computed in double from the rounded origin, and rounded to float once. So a ray passes its corner or
// edge at a distance of about 2^-24 of the ray's length: below the resolution of float. Lattice meshes are not rotated
// and are only moved by whole numbers, so all of these steps are exact for their rays: such a ray passes through the
// corner, or through a point of the edge.
//
// The rounded origin is still inside the mesh. The error of the offset is 2^-24 of the offset, at most 2^-19 of the
// mesh's radius. The error of frame + offset, with a frame of up to 2e6, is 2^-33, which is 2^-23 of the smallest
// radius used, 1e-3. Positions are at most 95 % of the inner radius away from the centre.
#ifndef LOCUS_TESTS_SUPPORT_PROOF_LEAK_PROOF_H_
#define LOCUS_TESTS_SUPPORT_PROOF_LEAK_PROOF_H_

#include <algorithm>
#include <string>
#include <vector>

#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "core/index/bvh/kernels/dispatch.h"
#include "tests/support/proof/closed_meshes.h"
#include "tests/support/small_world.h"

namespace locus::test {

struct LeakTally {
  uint64_t rays = 0;  // number of rays; each is traced for first, any and all hits by each instruction set
  uint64_t leaks = 0;
  std::vector<std::string> first_leaks;

  void add(const LeakTally& other) {
    rays += other.rays;
    leaks += other.leaks;
    for (const std::string& leak : other.first_leaks)
      if (first_leaks.size() < 10) first_leaks.push_back(leak);
  }
};

// Returns four closed meshes: two icospheres, a blob and an icosphere on a lattice. The meshes have 1,280 to 5,120
// triangles if `finer` is 0, and 5,120 to about 50,000 triangles if `finer` is 1.
inline std::vector<ClosedMesh> meshes_with_an_inside(int finer, uint64_t seed) {
  return {icosphere(4 + finer, 0.01, 0, seed), icosphere(3 + finer, 0.1, 0, seed + 1),
          small_blob(finer == 0 ? 5'000 : 50'000, seed), icosphere(3 + finer, 0.02, 0x1p-12, seed)};
}

class LeakProof {
 public:
  LeakProof(uint64_t seed, std::vector<ClosedMesh> meshes) : seed_(seed), meshes_(std::move(meshes)) {}

  // Traces `rays` rays in total, the same number for each mesh. Each mesh is scaled by `scale`, either in its vertices
  // or in its transform, and its position on each axis is at most `distance` from the origin.
  LeakTally run(double scale, double distance, uint64_t rays) const {
    Random random(seed_ + static_cast<uint64_t>(distance));
    LeakTally tally;
    for (const ClosedMesh& mesh : meshes_) {
      const bool baked = random.chance(0.5) && mesh.lattice == 0;
      const ClosedMesh stored = baked ? scaled(mesh, scale) : mesh;
      QueryWorld world;
      world.instances = {placement(mesh, baked ? 1 : scale, distance, random)};
      world.instances[0].mesh = mesh_of(stored.triangles);
      const SnapshotPtr snapshot = snapshot_of(world);
      const Transform& transform = snapshot->statics->find(1)->transform;
      for (uint64_t done = 0; done * meshes_.size() < rays; done += kBlockRays)
        tally.add(ask(*snapshot, rays_at_borders(stored, transform, done, random)));
    }
    return tally;
  }

 private:
  static constexpr uint64_t kBlockRays = 2'000;

  static ClosedMesh scaled(ClosedMesh mesh, double scale) {
    for (Triangle& triangle : mesh.triangles)
      for (Vec3f* vertex : {&triangle.a, &triangle.b, &triangle.c}) *vertex = to_float(to_double(*vertex) * scale);
    mesh.inner_radius *= scale;
    return mesh;
  }

  static PlacedMesh placement(const ClosedMesh& mesh, double scale, double distance, Random& random) {
    PlacedMesh placed;
    placed.id = 1;
    placed.scale = static_cast<float>(scale);
    placed.translation = random.vector(distance);
    placed.rotation = random.rotation();
    if (mesh.lattice == 0) return placed;
    placed.rotation = {};
    if (scale < 1) placed.scale = 0x1p-10f;  // a power of two, because 1e-3 would be rounded
    for (int axis = 0; axis < 3; ++axis) placed.translation[axis] = std::round(placed.translation[axis]);
    return placed;
  }

  // Returns a random position, in mesh axes, whose distance from the origin is at most 95 % of the inner radius.
  static Vec3d place_inside(const ClosedMesh& mesh, Random& random) {
    Vec3d place = random.unit_vector() * (mesh.inner_radius * random.between(0, 0.95));
    for (int axis = 0; axis < 3 && mesh.lattice != 0; ++axis)
      place[axis] = std::trunc(place[axis] / mesh.lattice) * mesh.lattice;
    return place;
  }

  // Returns a corner of the triangle, the middle of the edge that starts at this corner, or another point of this edge,
  // sometimes very near the corner.
  static Vec3d place_of_border(const ClosedMesh& mesh, const Triangle& triangle, uint64_t turn, Random& random) {
    const Vec3d corners[] = {to_double(triangle.a), to_double(triangle.b), to_double(triangle.c)};
    const Vec3d from = corners[turn % 3], along = corners[(turn + 1) % 3] - from;
    const uint64_t kind = turn / 3 % 3;
    if (kind == 0) return from;
    if (kind == 1) return from + along * 0.5;
    if (mesh.lattice != 0) return from + along * 0.25;
    return from + along * (random.chance(0.3) ? random.magnitude(-30, -1) : random.unit());
  }

  // Returns the rays with the numbers `first` to `first` + kBlockRays - 1. Each ray is aimed at a corner or an edge of
  // a triangle. Successive rays take triangles kStride apart, so that even a few rays are spread over the whole mesh.
  static OwnedBlock rays_at_borders(const ClosedMesh& mesh, const Transform& transform, uint64_t first,
                                    Random& random) {
    constexpr uint64_t kStride = 7'919;  // a prime that does not divide any mesh's number of triangles
    OwnedBlock block = rays_along_x(RayMode::kFirst, {});
    block.sizes.clear();
    const uint64_t count = mesh.triangles.size();
    const double reach = mesh.lattice == 0 ? 5 * transform.scale * mesh.inner_radius : 0;
    block.settings.frame = transform.translation + random.vector(random.chance(0.5) ? reach : 0);
    const auto turned = [&](Vec3d mesh_place) {
      return transform.rotation.to_world(mesh_place) * double{transform.scale};
    };
    for (uint64_t i = first; i < first + kBlockRays; ++i) {
      const Vec3d inside = transform.translation + turned(place_inside(mesh, random));
      const Vec3f offset = to_float(inside - block.settings.frame);
      const Vec3d origin = block.settings.frame + to_double(offset);  // rounded as by the server
      const Vec3d target = place_of_border(mesh, mesh.triangles[i * kStride % count], i / count, random);
      const Vec3f direction = to_float(turned(target) - (origin - transform.translation));
      block.points.insert(block.points.end(), {offset.x, offset.y, offset.z});
      block.sizes.insert(block.sizes.end(), {direction.x, direction.y, direction.z});
    }
    return block;
  }

  static LeakTally ask(const SceneSnapshot& snapshot, OwnedBlock block) {
    LeakTally tally;
    tally.rays = kBlockRays;
    for (const std::string& set : instruction_sets()) {
      LOCUS_CHECK(use_instruction_set(set).ok());
      for (const RayMode mode : {RayMode::kFirst, RayMode::kAny, RayMode::kAll}) {
        rays_of(block).mode = mode;
        block.settings.max_results = 1;
        const BlockResult result = run_block(snapshot, block);
        for (size_t i = 0; i < kBlockRays; ++i) {
          const bool hit = mode == RayMode::kFirst ? result.ids[i] != kNoId
                           : mode == RayMode::kAny ? result.hits[i] != '\0'
                                                   : result.counts[i] != 0;
          if (hit) continue;
          ++tally.leaks;
          if (tally.first_leaks.size() < 10) tally.first_leaks.push_back(describe(block, i, set));
        }
      }
    }
    LOCUS_CHECK(use_instruction_set("").ok());
    return tally;
  }

  static std::string describe(const OwnedBlock& block, size_t ray, const std::string& set) {
    const float *o = &block.points[3 * ray], *d = &block.sizes[3 * ray];
    const Vec3d frame = block.settings.frame;
    return absl::StrFormat("%s, mode %d: frame %a %a %a, origin %a %a %a, direction %a %a %a", set,
                           static_cast<int>(rays_mode(block)), frame.x, frame.y, frame.z, o[0], o[1], o[2], d[0], d[1],
                           d[2]);
  }
  static RayMode rays_mode(const OwnedBlock& block) { return std::get<RayColumns>(block.settings.kind).mode; }

  const uint64_t seed_;
  const std::vector<ClosedMesh> meshes_;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_PROOF_LEAK_PROOF_H_
