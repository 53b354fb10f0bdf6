// Closed meshes with a known interior, for the proof that no ray leaks out of them. Neighbouring triangles have bitwise
// equal vertices, and the ball of `inner_radius` around the origin lies inside the mesh. Plain data and functions
// without state.
#ifndef LOCUS_TESTS_SUPPORT_PROOF_CLOSED_MESHES_H_
#define LOCUS_TESTS_SUPPORT_PROOF_CLOSED_MESHES_H_

#include <array>
#include <map>
#include <utility>
#include <vector>

#include "client/cli/levels/generate/blob.h"
#include "tests/support/generated_meshes.h"

namespace locus::test {

struct ClosedMesh {
  std::vector<Triangle> triangles;
  double inner_radius;
  double lattice = 0;  // all coordinates are multiples of this number; 0 means no lattice
};

// Returns a mesh of 20 * 4^level triangles: an icosahedron whose edges are halved `level` times and whose vertices are
// projected to a distance of 1 plus or minus `noise` from the origin. Unless `lattice` is 0, coordinates are rounded to
// multiples of `lattice`.
inline ClosedMesh icosphere(int level, double noise, double lattice, uint64_t seed) {
  using Corners = std::array<size_t, 3>;
  const double g = (1 + std::sqrt(5.0)) / 2;
  std::vector<Vec3d> points = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                               {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  std::vector<Corners> faces = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                                {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                                {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int i = 0; i < level; ++i) {
    std::map<std::pair<size_t, size_t>, size_t> middles;
    const auto middle = [&](size_t a, size_t b) {
      const auto [place, is_new] = middles.try_emplace(std::minmax(a, b), points.size());
      if (is_new) points.push_back(points[a] + points[b]);
      return place->second;
    };
    std::vector<Corners> parts;
    for (const auto& [a, b, c] : faces) {
      const size_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      parts.insert(parts.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    faces = std::move(parts);
    for (Vec3d& point : points) point = normalized(point);
  }
  Random random(seed);
  for (Vec3d& point : points) {
    point = normalized(point) * (1 + random.between(-noise, noise));
    for (int axis = 0; axis < 3 && lattice != 0; ++axis) point[axis] = std::round(point[axis] / lattice) * lattice;
  }
  ClosedMesh mesh{{}, 0.9 * (1 - noise), lattice};
  for (const auto& [a, b, c] : faces)
    mesh.triangles.push_back({to_float(points[a]), to_float(points[b]), to_float(points[c])});
  number_in_order(mesh.triangles);
  return mesh;
}

// Returns the mesh of `locus generate blob`, scaled to a radius of about one.
inline ClosedMesh small_blob(uint64_t triangles, uint64_t seed) {
  const cli::ImportedMesh blob = cli::generate_blob(triangles, seed);
  ClosedMesh mesh{{}, 0.9 * 0.1 * cli::kMinBlobRadius, 0};
  const auto vertex = [&](size_t index) {
    const float* const at = &blob.vertices[3 * size_t{blob.indices[index]}];
    return Vec3f{at[0], at[1], at[2]} * 0.1f;
  };
  for (size_t i = 0; i < blob.indices.size(); i += 3)
    mesh.triangles.push_back({vertex(i), vertex(i + 1), vertex(i + 2)});
  number_in_order(mesh.triangles);
  return mesh;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_PROOF_CLOSED_MESHES_H_
