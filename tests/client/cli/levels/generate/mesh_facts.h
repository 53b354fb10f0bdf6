// Properties of meshes that the tests of all generators check. Functions without state.
#ifndef LOCUS_TESTS_CLIENT_CLI_LEVELS_GENERATE_MESH_FACTS_H_
#define LOCUS_TESTS_CLIENT_CLI_LEVELS_GENERATE_MESH_FACTS_H_

#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <unordered_set>

#include "client/cli/levels/import/imported_mesh.h"
#include "tests/support/sha256_hex.h"

namespace locus::cli::testing {

using Point = std::array<double, 3>;

inline Point vertex(const ImportedMesh& mesh, uint32_t index) {
  return {mesh.vertices[3 * index], mesh.vertices[3 * index + 1], mesh.vertices[3 * index + 2]};
}

inline Point minus(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline double dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// Returns the normal of a triangle; its length is twice the triangle's area.
inline Point normal(const ImportedMesh& mesh, size_t triangle) {
  const Point a = vertex(mesh, mesh.indices[3 * triangle]);
  return cross(minus(vertex(mesh, mesh.indices[3 * triangle + 1]), a),
               minus(vertex(mesh, mesh.indices[3 * triangle + 2]), a));
}

// Inserts the directed edges of the mesh into `edges`. Returns the number of edges that occur more than once: 0 if the
// triangles are consistently oriented.
inline size_t repeated_edges(const ImportedMesh& mesh, std::unordered_set<uint64_t>& edges) {
  size_t repeated = 0;
  for (size_t i = 0; i < mesh.indices.size(); ++i) {
    const uint32_t next = mesh.indices[i % 3 == 2 ? i - 2 : i + 1];
    if (!edges.insert(uint64_t{mesh.indices[i]} << 32 | next).second) ++repeated;
  }
  return repeated;
}

// Returns the number of directed edges whose opposite edge is not in `edges`: the edges of the mesh's border.
inline size_t open_edges(const std::unordered_set<uint64_t>& edges) {
  size_t open = 0;
  for (const uint64_t edge : edges) open += edges.count(edge << 32 | edge >> 32) == 0 ? 1 : 0;
  return open;
}

// Returns the SHA-256 of the bytes of the mesh's vertices and indices, in hexadecimal.
inline std::string bytes_hash(const ImportedMesh& mesh) {
  std::string bytes(mesh.vertices.size() * sizeof(float) + mesh.indices.size() * sizeof(uint32_t), 0);
  std::memcpy(bytes.data(), mesh.vertices.data(), mesh.vertices.size() * sizeof(float));
  std::memcpy(bytes.data() + mesh.vertices.size() * sizeof(float), mesh.indices.data(),
              mesh.indices.size() * sizeof(uint32_t));
  return test::sha256_hex(bytes);
}

}  // namespace locus::cli::testing

#endif  // LOCUS_TESTS_CLIENT_CLI_LEVELS_GENERATE_MESH_FACTS_H_
