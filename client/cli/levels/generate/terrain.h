// Made-up hills, for trying the server with open ground and for tests that need a large connected surface. A function
// without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_GENERATE_TERRAIN_H_
#define LOCUS_CLIENT_CLI_LEVELS_GENERATE_TERRAIN_H_

#include <cstdint>

#include "client/cli/levels/import/imported_mesh.h"

namespace locus::cli {

inline constexpr uint64_t kMinTerrainTriangles = 2;
inline constexpr uint64_t kMaxTerrainTriangles = uint64_t{1} << 27;
// No height is further from 0.
inline constexpr double kMaxTerrainHeight = 48;

// A sheet of n x m squares of one metre around the origin, each cut into two triangles, counter-clockwise seen from
// above; z is up, heights are fractal noise (gradient_noise.h) with hills 256 m apart. n is the whole part of the
// square root of half of `triangles`, m the most that fits: so at most `triangles` and more than triangles - 2 n. None
// of them is without area. Counts outside the minimum and maximum are moved to them. One part: "terrain". The same
// arguments give the same bytes on every machine. Cost: linear, about a microsecond a vertex and 18 bytes a triangle.
ImportedMesh generate_terrain(uint64_t triangles, uint64_t seed);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_GENERATE_TERRAIN_H_
