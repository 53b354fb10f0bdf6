// Generator of a city of boxes. It is used to try the server without a level file, and by tests that need known
// geometry. A function without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_GENERATE_CITY_H_
#define LOCUS_CLIENT_CLI_LEVELS_GENERATE_CITY_H_

#include <cstdint>

#include "client/cli/levels/import/imported_mesh.h"

namespace locus::cli {

inline constexpr uint64_t kMinCityTriangles = 12;
inline constexpr uint64_t kMaxCityTriangles = uint64_t{1} << 27;

// Returns a ground slab whose top is at z = 0, and box buildings on square lots around the origin. A third of the
// buildings are towers of two to four boxes that touch face to face. Units are metres, z is up. Each box is 12
// consecutive triangles over 8 consecutive vertices of its own, closed and counter-clockwise seen from outside. The
// slab is the first box. All coordinates are multiples of 0.5, so they are exact in float, and many faces are coplanar.
// Parts: "ground" and "buildings". `triangles` is clamped to 12 (only the slab) .. kMaxCityTriangles; the mesh then has
// the largest multiple of 12 triangles that is at most `triangles`. Equal arguments give equal bytes on every machine.
// Cost: linear; memory: 240 bytes per box.
ImportedMesh generate_city(uint64_t triangles, uint64_t seed);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_GENERATE_CITY_H_
