// Comparisons of containment, views, sight, pairs and cells with simple references. Used by the tests of these query
// kinds and by the tests of planted bugs in them.
#ifndef LOCUS_TESTS_SUPPORT_KIND_TRIALS_H_
#define LOCUS_TESTS_SUPPORT_KIND_TRIALS_H_

#include <array>
#include <string>
#include <vector>

#include "core/geometry/point_in_mesh.h"
#include "core/query/frustum_planes.h"
#include "tests/support/exact_crossing.h"
#include "tests/support/half_lines.h"
#include "tests/support/owned_block.h"
#include "tests/support/random.h"
#include "tests/support/small_world.h"
#include "tests/support/test_scale.h"

namespace locus::test {

// Returns the first point whose winding number in an octahedron is wrong along one of the half lines; empty if there is
// none. The points' coordinates are multiples of 1/8, so that half lines meet edges and corners of the triangles.
inline std::string contains_difference() {
  std::vector<Triangle> octahedron;
  for (int octant = 0; octant < 8; ++octant) {
    const auto side = [octant](int bit) { return (octant >> bit & 1) != 0 ? -1.0f : 1.0f; };
    const Triangle face{{side(0), 0, 0}, {0, side(1), 0}, {0, 0, side(2)}, 0};
    octahedron.push_back(side(0) * side(1) * side(2) > 0 ? face : turned_over(face));
  }
  for (int cell = 0; cell < 21 * 21 * 21; ++cell) {
    const Vec3d point = Vec3d{double(cell % 21) - 10, double(cell / 21 % 21) - 10, double(cell / 441) - 10} * 0.125;
    const double from_center = std::abs(point.x) + std::abs(point.y) + std::abs(point.z);
    for (const HalfLine line : kHalfLines) {
      int winding = 0;
      bool on_surface = false;
      for (const Triangle& triangle : octahedron) {
        const Crossing found = crossing(point, triangle, line);
        winding += found.winding;
        on_surface |= found.on_surface;
      }
      if (on_surface != (from_center == 1) || (!on_surface && winding != (from_center < 1 ? 1 : 0)))
        return "winding " + std::to_string(winding) + " at cell " + std::to_string(cell);
    }
  }
  return "";
}

// Returns the first seed for whose random triangle and point crossing() differs from exact_crossing(), which computes
// in integers; empty if there is none.
inline std::string crossing_difference() {
  for (uint64_t seed = 0; seed < scaled_count(20'000); ++seed) {
    Random random(seed);
    const NearTrial trial = near_trial(random);
    const Crossing found = crossing(trial.point, trial.triangle), exact = exact_crossing(trial.point, trial.triangle);
    if (found.winding != exact.winding || found.on_surface != exact.on_surface) return "seed " + std::to_string(seed);
  }
  return "";
}

// Returns the first seed for which the planes of a random view and the clip coordinates of a random point disagree
// about whether the point is in the view; empty if there is none.
inline std::string view_difference() {
  for (uint64_t seed = 0; seed < scaled_count(300); ++seed) {
    Random random(seed);
    // A perspective projection along -z after a random rotation and translation.
    const double near = random.between(0.1, 1), far = near + random.between(1, 20);
    const double across = random.between(0.5, 2), up = random.between(0.5, 2);
    const Rotation rotation = rotation_of(random.rotation());
    const Vec3d eye = random.vector(5);
    const bool opengl = random.chance(0.5);
    const double z = opengl ? -(far + near) / (far - near) : -far / (far - near);
    const double w = opengl ? -2 * far * near / (far - near) : -far * near / (far - near);
    const std::array<Vec3d, 3> axes = {rotation.to_local({1, 0, 0}), rotation.to_local({0, 1, 0}),
                                       rotation.to_local({0, 0, 1})};  // columns of the matrix to view axes
    std::vector<float> matrix;
    const auto add_column = [&](Vec3d view, double one) {
      for (const double value : {across * view.x, up * view.y, z * view.z + w * one, -view.z})
        matrix.push_back(static_cast<float>(value));
    };
    for (const Vec3d& axis : axes) add_column(axis, 0);
    add_column(rotation.to_local(-eye), 1);
    FrustumColumns frustums;
    frustums.view_projections = matrix;
    frustums.clip_depth = opengl ? ClipDepth::kMinusOneToOne : ClipDepth::kZeroToOne;
    const FrustumPlanes planes(frustums, 0);
    for (int i = 0; i < 100; ++i) {
      const Vec3d point = eye + random.vector(25);
      std::array<double, 4> clip{};
      for (size_t row = 0; row < 4; ++row)
        clip[row] = matrix[row] * point.x + matrix[4 + row] * point.y + matrix[8 + row] * point.z + matrix[12 + row];
      const auto [cx, cy, cz, cw] = clip;
      const double margin = std::min({cw + cx, cw - cx, cw + cy, cw - cy, opengl ? cw + cz : cz, cw - cz});
      bool within = true;
      for (const Plane& plane : planes.planes()) within &= dot(plane.normal, point) + plane.offset >= 0;
      if (std::abs(margin) > 1e-6 && within != (margin > 0)) return "seed " + std::to_string(seed);
    }
  }
  return "";
}

// Returns the first seed for which a viewer's sight is blocked by a member of its own group or of the target's group,
// or is not blocked by an object of another group; empty if there is none.
inline std::string sight_difference() {
  for (uint64_t seed = 0; seed < scaled_count(50); ++seed) {
    Random random(seed);
    QueryWorld world;
    Object own = ball_object(1, {2, 0, 0}), other = ball_object(2, {6, 0, 0});
    own.group = 1 + random.below(3);
    other.group = 4 + random.below(3);
    PlacedMesh wall = placed(3, wall_mesh(), {4, 0, 0});
    wall.group = random.chance(0.5) ? own.group : other.group;
    world.objects = {own, other};
    world.instances = {wall};
    OwnedBlock block;
    block.settings.kind = SightColumns{};
    block.points = {0, 0, 0};
    block.sizes = {9, 0, 0};
    block.groups = {own.group};
    block.target_groups = {other.group};
    if (run_block(*snapshot_of(world), block).matrix != std::string(1, '\1')) return "seed " + std::to_string(seed);
    block.groups = {0};
    if (run_block(*snapshot_of(world), block).matrix != std::string(1, '\0')) return "seed " + std::to_string(seed);
  }
  return "";
}

// Returns the first error in the pairs of balls on a line, where every two neighbours must be a pair exactly once;
// empty if there is none.
inline std::string pair_difference() {
  for (size_t balls = 2; balls < 20; ++balls) {
    QueryWorld world;
    for (size_t i = 0; i < balls; ++i)
      world.objects.push_back(ball_object(1 + i, {3.0 * static_cast<double>(i), 0, 0}));
    OwnedBlock block;
    PairColumns pairs;
    pairs.max_distance = 1.5f;
    block.settings.kind = pairs;
    const BlockResult result = run_block(*snapshot_of(world), block);
    if (result.ids.size() != balls - 1) return std::to_string(result.ids.size()) + " pairs";
    for (size_t i = 0; i + 1 < balls; ++i)
      if (result.ids[i] != i + 1 || result.others[i] != i + 2) return "pair " + std::to_string(i);
  }
  return "";
}

// Returns the first seed for which a frustum does not contain the same balls as a test of all balls; empty if there is
// none. The balls fill many bricks of the grid, and a frustum contains some of the bricks whole.
inline std::string frustum_difference() {
  for (uint64_t seed = 0; seed < scaled_count(20); ++seed) {
    Random random(seed);
    QueryWorld world;
    for (Id id = 1; id <= 2'000; ++id) world.objects.push_back(ball_object(id, random.vector(60)));
    OwnedBlock block;
    const Vec3d eye = random.vector(40);
    for (int plane = 0; plane < 6; ++plane) {
      const Vec3d normal = random.unit_vector();
      for (const double value : {normal.x, normal.y, normal.z, random.between(5, 40) - dot(normal, eye)})
        block.points.push_back(static_cast<float>(value));
    }
    FrustumColumns frustums;
    frustums.planes_each = 6;
    block.settings.kind = frustums;
    block.settings.max_results = 5'000;
    const SnapshotPtr snapshot = snapshot_of(world);
    RunOptions brute_force;
    brute_force.brute_force = true;
    if (run_block(*snapshot, block).ids != run_block(*snapshot, block, brute_force).ids)
      return "seed " + std::to_string(seed);
  }
  return "";
}

// Checks the cell of a point between a ball and a wall of many triangles. The cell must have exactly three rows: one
// for the cell itself, one for the plane of the wall and one for the plane of the ball. Returns a description of the
// error; empty if there is none.
inline std::string cell_difference() {
  std::vector<Triangle> wall;
  for (int y = -8; y < 8; ++y)
    for (int z = -8; z < 8; ++z) {
      const auto at = [&](int dy, int dz) { return Vec3f{5, static_cast<float>(y + dy), static_cast<float>(z + dz)}; };
      wall.push_back({at(0, 0), at(1, 0), at(1, 1), static_cast<uint32_t>(wall.size())});
      wall.push_back({at(0, 0), at(1, 1), at(0, 1), static_cast<uint32_t>(wall.size())});
    }
  QueryWorld world;
  world.instances = {placed(1, mesh_of(wall))};
  world.objects = {ball_object(2, {-4, 0, 0})};
  OwnedBlock block;
  block.settings.kind = CellColumns{};
  block.points = {0.25f, 0.25f, 0.25f};
  block.extras = {9};
  const BlockResult result = run_block(*snapshot_of(world), block);
  return result.counts[0] == 3 ? "" : std::to_string(result.counts[0]) + " rows";
}

// Returns the first seed for which rays and balls with random filters find other ids than a plain test of each object
// and instance; empty if there is none. Every query meets every object and instance, so only the filters decide.
inline std::string filter_difference() {
  for (uint64_t seed = 0; seed < scaled_count(400); ++seed) {
    Random random(seed);
    QueryWorld world;
    Id next = 1;
    const auto label = [&](auto item) {
      item.id = next++;
      item.group = random.below(4);
      item.tag = random.below(8);
      return item;
    };
    for (int i = 0; i < 4; ++i) world.instances.push_back(label(placed(0, wall_mesh())));
    for (int i = 0; i < 6; ++i) world.objects.push_back(label(ball_object(0, {})));
    OwnedBlock block;
    block.settings.only_groups_each = 2;
    constexpr uint64_t kTagMasks[] = {0, 1, 2, 6, ~uint64_t{0}};
    for (int i = 0; i < 5; ++i) {
      block.points.insert(block.points.end(), {-5, 0, 0});
      block.self_ids.push_back(random.below(next));
      block.tags.push_back(random.below(8));
      block.tag_masks.push_back(random.pick(kTagMasks));
      for (int k = 0; k < 2; ++k) block.only_groups.push_back(random.below(4));
    }
    if (random.chance(0.5)) block.self_ids.clear();
    if (random.chance(0.5)) block.tags.clear(), block.tag_masks.clear();
    if (random.chance(0.5)) block.only_groups.clear();
    const auto wanted = [&](const auto& item, size_t i) {
      const uint64_t a = block.only_groups.empty() ? 0 : block.only_groups[2 * i];
      const uint64_t b = block.only_groups.empty() ? 0 : block.only_groups[2 * i + 1];
      const bool in_group = (a == 0 && b == 0) || (item.group != 0 && (item.group == a || item.group == b));
      const bool has_tag = block.tags.empty() || ((item.tag ^ block.tags[i]) & block.tag_masks[i]) == 0;
      return in_group && has_tag && (block.self_ids.empty() || block.self_ids[i] != item.id);
    };
    std::vector<uint32_t> counts;
    for (size_t i = 0; i < 5; ++i) {
      uint32_t count = 0;
      for (const PlacedMesh& mesh : world.instances) count += wanted(mesh, i) ? 1 : 0;
      for (const Object& object : world.objects) count += wanted(object, i) ? 1 : 0;
      counts.push_back(count);
    }
    const SnapshotPtr snapshot = snapshot_of(world);
    RayColumns rays;
    rays.mode = RayMode::kAll;
    block.settings.kind = rays;
    block.sizes = {1, 0, 0};
    if (run_block(*snapshot, block).counts != counts) return "rays, seed " + std::to_string(seed);
    block.settings.kind = BallColumns{};
    block.sizes = {6};
    if (run_block(*snapshot, block).counts != counts) return "balls, seed " + std::to_string(seed);
  }
  return "";
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_KIND_TRIALS_H_
