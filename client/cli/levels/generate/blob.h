// Generator of a closed body. It is used to try the server with a mesh that has an interior, and by tests that check
// that no ray passes between adjacent triangles. A function without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_GENERATE_BLOB_H_
#define LOCUS_CLIENT_CLI_LEVELS_GENERATE_BLOB_H_

#include <cstdint>

#include "client/cli/levels/import/imported_mesh.h"

namespace locus::cli {

inline constexpr uint64_t kMinBlobTriangles = 8;
inline constexpr uint64_t kMaxBlobTriangles = uint64_t{1} << 27;
// Minimum and maximum distance of a vertex from the origin.
inline constexpr double kMinBlobRadius = 6;
inline constexpr double kMaxBlobRadius = 14;

// Returns an octahedron whose edges are divided into f segments, projected to a sphere and displaced by fractal noise
// (gradient_noise.h). It has 8 f^2 triangles and 4 f^2 + 2 vertices; f is the largest number that gives at most
// `triangles` triangles. `triangles` is clamped to kMinBlobTriangles .. kMaxBlobTriangles. The mesh is closed without
// seams: no vertex is duplicated, and every edge belongs to two triangles that traverse it in opposite directions.
// Triangles are counter-clockwise seen from outside. The body is star-shaped: each ray from the origin crosses the
// surface once. Units are metres. No triangle has zero area. One part: "blob". Equal arguments give equal bytes on
// every machine. Cost: linear, about a microsecond per vertex; memory: 18 bytes per triangle.
ImportedMesh generate_blob(uint64_t triangles, uint64_t seed);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_GENERATE_BLOB_H_
