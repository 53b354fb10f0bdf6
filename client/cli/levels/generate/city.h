// A made-up city of boxes, for trying the server without a level at hand and for tests that need known geometry. A
// function without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_GENERATE_CITY_H_
#define LOCUS_CLIENT_CLI_LEVELS_GENERATE_CITY_H_

#include <cstdint>

#include "client/cli/levels/import/imported_mesh.h"

namespace locus::cli {

inline constexpr uint64_t kMinCityTriangles = 12;
inline constexpr uint64_t kMaxCityTriangles = uint64_t{1} << 27;

// A ground slab whose top is z = 0 and box buildings on it, a third of them towers of two to four steps, on square lots
// around the origin. Metres, z up. Each box is 12 consecutive triangles over 8 consecutive vertices of its own: closed,
// counter-clockwise seen from outside; the slab comes first. All coordinates are multiples of 0.5, so they are exact in
// float and many faces lie in common planes. Steps of a tower touch face to face. Parts: "ground" and "buildings".
// At most `triangles` triangles and more than triangles - 12, but never fewer than the slab's 12 nor more than
// kMaxCityTriangles. The same arguments give the same bytes on every machine. Cost: linear, about 160 bytes a box.
ImportedMesh generate_city(uint64_t triangles, uint64_t seed);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_GENERATE_CITY_H_
