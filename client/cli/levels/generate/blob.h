// A made-up closed body, for trying the server with a thing that has an inside and for tests that look for leaks. A
// function without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_GENERATE_BLOB_H_
#define LOCUS_CLIENT_CLI_LEVELS_GENERATE_BLOB_H_

#include <cstdint>

#include "client/cli/levels/import/imported_mesh.h"

namespace locus::cli {

inline constexpr uint64_t kMinBlobTriangles = 8;
inline constexpr uint64_t kMaxBlobTriangles = uint64_t{1} << 27;
// Every vertex is between these far from the origin.
inline constexpr double kMinBlobRadius = 6;
inline constexpr double kMaxBlobRadius = 14;

// An octahedron whose edges are cut into f pieces, blown up to a sphere and dented by fractal noise (gradient_noise.h):
// 8 f^2 triangles over 4 f^2 + 2 vertices, f the largest that keeps to `triangles`. Closed without seams: every vertex
// stands once, every edge belongs to two triangles and runs both ways. Counter-clockwise seen from outside, and star
// shaped: each ray from the origin leaves through one place. Metres. None of the triangles is without area. Counts
// outside the minimum and maximum are moved to them. One part: "blob". The same arguments give the same bytes on every
// machine. Cost: linear, about a microsecond a vertex and 18 bytes a triangle.
ImportedMesh generate_blob(uint64_t triangles, uint64_t seed);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_GENERATE_BLOB_H_
