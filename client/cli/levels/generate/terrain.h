// Generator of hills. It is used to try the server with open ground, and by tests that need a large connected surface.
// A function without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_GENERATE_TERRAIN_H_
#define LOCUS_CLIENT_CLI_LEVELS_GENERATE_TERRAIN_H_

#include <cstdint>

#include "client/cli/levels/import/imported_mesh.h"

namespace locus::cli {

inline constexpr uint64_t kMinTerrainTriangles = 2;
inline constexpr uint64_t kMaxTerrainTriangles = uint64_t{1} << 27;
// Maximum absolute value of z, in metres.
inline constexpr double kMaxTerrainHeight = 48;

// Returns a sheet of n x m squares of one metre around the origin. Each square is two triangles, counter-clockwise seen
// from above. z is up; heights are fractal noise (gradient_noise.h) with hills 256 m apart. n is the integer part of
// the square root of triangles / 2, and m is the largest number with 2 n m <= triangles, so the mesh has more than
// triangles - 2 n triangles. `triangles` is clamped to kMinTerrainTriangles .. kMaxTerrainTriangles. No triangle has
// zero area. One part: "terrain". Equal arguments give equal bytes on every machine. Cost: linear, about a microsecond
// per vertex; memory: 18 bytes per triangle.
ImportedMesh generate_terrain(uint64_t triangles, uint64_t seed);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_GENERATE_TERRAIN_H_
