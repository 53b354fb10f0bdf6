// Proves that contains queries find the points inside a closed mesh and no point outside. The query engine is asked
// about points in and around placed meshes, with every instruction set. The answers are compared with the solid angles
// of all triangles in long double and, for points at the surface of meshes that are not rotated, with crossings in
// integers. Each run tests tens of thousands of points, the long run a million.
#include <gtest/gtest.h>

#include <cstdio>
#include <numbers>

#include "core/geometry/point_triangle.h"
#include "core/index/bvh/kernels/dispatch.h"
#include "tests/support/exact_crossing.h"
#include "tests/support/proof/closed_meshes.h"
#include "tests/support/proof/leak_proof.h"
#include "tests/support/real.h"
#include "tests/support/small_world.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

constexpr uint64_t kContainsSeed = 618;

using Mesh = std::vector<Triangle>;

// Returns the winding number of a closed mesh around a point, not rounded to an integer: the sum of the solid angles of
// its triangles. Source: Van Oosterom, Strackee, The Solid Angle of a Plane Triangle, 1983.
Real winding_by_angles(Vec3r point, const Mesh& mesh) {
  Real sum = 0;
  for (const Triangle& triangle : mesh) {
    const Vec3r a = to_real(triangle.a) - point, b = to_real(triangle.b) - point, c = to_real(triangle.c) - point;
    const Real la = length(a), lb = length(b), lc = length(c);
    sum += 2 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return sum / (4 * std::numbers::pi_v<Real>);
}

// Adds the triangles of `other` to `mesh`, scaled by `scale` and then moved by `offset`; if `reversed` is true, with
// the opposite orientation.
void add_shell(const Mesh& other, float scale, Vec3f offset, bool reversed, Mesh& mesh) {
  for (const Triangle& t : other) {
    const Triangle moved{t.a * scale + offset, t.b * scale + offset, t.c * scale + offset};
    mesh.push_back(reversed ? turned_over(moved) : moved);
  }
  number_in_order(mesh);
}

// Returns a torus of radii 1 and `inner`. Neighbouring triangles have bitwise equal corners.
Mesh torus(int sides, double inner) {
  const auto corner = [&](int i, int j) {
    const double u = 2 * std::numbers::pi * (i % sides) / sides, v = 2 * std::numbers::pi * (j % sides) / sides;
    const double out = 1 + inner * std::cos(v);
    return to_float(Vec3d{out * std::cos(u), out * std::sin(u), inner * std::sin(v)});
  };
  Mesh mesh;
  for (int i = 0; i < sides; ++i) {
    for (int j = 0; j < sides; ++j) {
      mesh.push_back({corner(i, j), corner(i + 1, j), corner(i + 1, j + 1)});
      mesh.push_back({corner(i, j), corner(i + 1, j + 1), corner(i, j + 1)});
    }
  }
  number_in_order(mesh);
  return mesh;
}

// Returns houses whose triangles are counter-clockwise as seen from outside, unlike those of box_city().
Mesh houses(int side, uint64_t seed) {
  constexpr size_t kTrianglesOfAHouse = 12;
  Mesh mesh = box_city(side, seed);
  for (size_t begin = 0; begin < mesh.size(); begin += kTrianglesOfAHouse) {
    Vec3d center;
    for (size_t i = begin; i < begin + kTrianglesOfAHouse; ++i)
      center = center + (to_double(mesh[i].a) + to_double(mesh[i].b) + to_double(mesh[i].c)) * (1.0 / 36);
    for (size_t i = begin; i < begin + kTrianglesOfAHouse; ++i) {
      const Vec3d a = to_double(mesh[i].a), normal = cross(to_double(mesh[i].b) - a, to_double(mesh[i].c) - a);
      if (dot(normal, a - center) < 0) std::swap(mesh[i].b, mesh[i].c);
    }
  }
  return mesh;
}

// Returns a random closed mesh: a sphere, a torus or houses, either alone or with a copy of itself. The copy is a
// cavity, a duplicate, an inverted mesh beside the original, a mesh that crosses the original, or an inverted
// duplicate.
Mesh random_mesh(Random& random) {
  const uint64_t seed = random.next();
  Mesh shell;
  switch (random.below(4)) {
    case 0:
      shell = icosphere(2, 0.1, random.chance(0.5) ? 0 : 0x1p-6, seed).triangles;
      break;
    case 1:
      shell = bumpy_sphere(5, 0.3, seed);
      break;
    case 2:
      shell = torus(10, random.between(0.1, 0.6));
      break;
    default:
      shell = houses(2, seed);
  }
  Mesh mesh = shell;
  const uint64_t form = random.below(6);
  if (form == 1) add_shell(shell, 0.5f, {}, true, mesh);
  if (form == 2) add_shell(shell, 1, {}, false, mesh);
  if (form == 3) add_shell(shell, 1, {3, 0, 0}, true, mesh);
  if (form == 4) add_shell(shell, 0.75f, {0.25f, 0.5f, -0.125f}, random.chance(0.5), mesh);
  if (form == 5) add_shell(shell, 1, {}, true, mesh);  // the copies cancel, so that no point is inside
  return mesh;
}

struct Tally {
  uint64_t points = 0, inside = 0, at_surface = 0, faults = 0;
  std::string first_fault;
};

// One placed mesh, the points of its queries, and the verification of the answers.
class Trial {
 public:
  explicit Trial(uint64_t seed) : seed_(seed), random_(seed), mesh_(random_mesh(random_)) {
    rotated_ = random_.chance(0.7);
    PlacedMesh placed;
    placed.id = 1;
    placed.mesh = mesh_of(mesh_);
    if (rotated_) {
      placed.rotation = random_.rotation();
      placed.scale = static_cast<float>(random_.magnitude(-10, 10));
      placed.translation = random_.vector(random_.magnitude(0, 20));
    }
    QueryWorld world;
    world.instances = {placed};
    snapshot_ = snapshot_of(world);
  }

  void run(size_t points, Tally& tally) {
    const Transform& transform = snapshot_->statics->find(1)->transform;
    OwnedBlock block;
    block.settings.kind = ContainsColumns{};
    block.settings.frame = transform.translation;
    for (size_t i = 0; i < points; ++i) {
      const Vec3f offset = to_float(transform.point_to_world(notable_point()) - transform.translation);
      block.points.insert(block.points.end(), {offset.x, offset.y, offset.z});
    }
    const BlockResult result = run_block(*snapshot_, block);
    for (const std::string& set : instruction_sets()) {
      LOCUS_CHECK(use_instruction_set(set).ok());
      if (run_block(*snapshot_, block).counts != result.counts) note("differs by " + set, tally);
    }
    LOCUS_CHECK(use_instruction_set("").ok());
    block.settings.precision = Precision::kConservative;
    const BlockResult bounds = run_block(*snapshot_, block);
    for (size_t i = 0; i < points; ++i) {
      if (result.counts[i] > bounds.counts[i]) note("point " + std::to_string(i) + " is outside of the bounds", tally);
      judge(transform.translation + read_vec3d(&block.points[3 * i]), result.counts[i] != 0, tally);
    }
  }

 private:
  // Returns a random point in mesh axes: on a corner, an edge or a face, near one of these, or anywhere.
  Vec3d notable_point() {
    const Triangle& t = random_.pick(mesh_);
    const Triangle& other = random_.pick(mesh_);
    const Vec3d a = to_double(t.a), b = to_double(t.b), c = to_double(t.c);
    Vec3d point = a;
    if (random_.chance(0.6)) point = (a + b) * 0.5;
    if (random_.chance(0.5)) point = a * 0.25 + b * 0.25 + c * 0.5;
    if (random_.chance(0.3)) point = (a + to_double(other.a)) * 0.5;
    // Moves the point along an axis, often away from the mesh: a line through the point along this axis still passes
    // exactly through a corner, an edge or a face.
    if (random_.chance(0.5)) point[random_.whole(0, 2)] = random_.between(-1.5, 1.5);
    if (random_.chance(0.5)) point = point + random_.vector(random_.magnitude(-20, 1));
    return point;
  }

  void judge(Vec3d world, bool found, Tally& tally) {
    const Transform& transform = snapshot_->statics->find(1)->transform;
    ++tally.points;
    tally.inside += found ? 1 : 0;
    const Vec3d local = transform.point_to_mesh(world);
    double nearest = std::numeric_limits<double>::infinity();
    for (const Triangle& triangle : mesh_) nearest = std::min(nearest, squared_distance(local, triangle));
    // The error of the transform to mesh axes is less than 2^-40 of this size.
    const double size = max_component(abs(local)) + 2 * double{magnitude(snapshot_->statics->find(1)->mesh->bounds())} +
                        max_component(abs(transform.translation)) / transform.scale;
    if (std::sqrt(nearest) <= 0x1p-40 * size) {
      ++tally.at_surface;
      if (!rotated_ && is_exactly_inside(local) != found) note("at the surface", tally);
      return;
    }
    const Vec3r real = turned_back(transform.quaternion, to_real(world) - to_real(transform.translation)) *
                       (1 / Real{transform.scale});
    const Real winding = winding_by_angles(real, mesh_);
    if ((std::lround(winding) != 0) != found) note("winding " + std::to_string(winding), tally);
  }

  bool is_exactly_inside(const Vec3d& point) const {
    int winding = 0;
    for (const Triangle& triangle : mesh_) {
      const Crossing found = exact_crossing(point, triangle);
      if (found.on_surface) return true;
      winding += found.winding;
    }
    return winding != 0;
  }

  void note(const std::string& what, Tally& tally) const {
    if (tally.faults++ == 0) tally.first_fault = "seed " + std::to_string(seed_) + ": " + what;
  }

  const uint64_t seed_;
  Random random_;
  const Mesh mesh_;
  bool rotated_ = false;
  SnapshotPtr snapshot_;
};

void expect_no_fault(uint64_t meshes, size_t points) {
  Tally tally;
  for (uint64_t i = 0; i < meshes; ++i) Trial(kContainsSeed + i).run(points, tally);
  EXPECT_EQ(tally.faults, 0u) << tally.first_fault;
  EXPECT_GT(tally.inside, tally.points / 10);
  EXPECT_GT(tally.at_surface, tally.points / 100);
  std::printf(
      "proof: %llu points in and around %llu closed meshes by %s, %llu inside, %llu at surfaces: %llu faults; "
      "seed %llu\n",
      static_cast<unsigned long long>(tally.points), static_cast<unsigned long long>(meshes),
      absl::StrJoin(instruction_sets(), ", ").c_str(), static_cast<unsigned long long>(tally.inside),
      static_cast<unsigned long long>(tally.at_surface), static_cast<unsigned long long>(tally.faults),
      static_cast<unsigned long long>(kContainsSeed));
}

TEST(ContainsProofTest, ClosedMeshesContainWhatTheyWindAround) { expect_no_fault(scaled_count(200), 100); }

TEST(LongContainsProofTest, ClosedMeshesContainWhatTheyWindAround) { expect_no_fault(2'000, 500); }

}  // namespace
}  // namespace locus::test
