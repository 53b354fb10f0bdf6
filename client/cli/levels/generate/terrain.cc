#include "client/cli/levels/generate/terrain.h"

#include <algorithm>

#include "client/cli/levels/generate/gradient_noise.h"
#include "client/cli/levels/generate/whole_root.h"

namespace locus::cli {
namespace {

constexpr double kHillDistance = 256;
constexpr int kOctaves = 7;  // so the shortest wavelength is 256 m / 2^6 = 4 m

}  // namespace

ImportedMesh generate_terrain(uint64_t triangles, uint64_t seed) {
  const uint64_t squares = std::clamp(triangles, kMinTerrainTriangles, kMaxTerrainTriangles) / 2;
  const uint64_t columns = whole_root(squares);
  const uint64_t rows = squares / columns;
  ImportedMesh mesh;
  mesh.name = "terrain";
  mesh.parts.push_back({"terrain", 0});
  mesh.vertices.reserve((columns + 1) * (rows + 1) * 3);
  mesh.indices.reserve(columns * rows * 6);
  for (uint64_t row = 0; row <= rows; ++row) {
    for (uint64_t column = 0; column <= columns; ++column) {
      const double x = static_cast<double>(column) - static_cast<double>(columns) * 0.5;
      const double y = static_cast<double>(row) - static_cast<double>(rows) * 0.5;
      const double height =
          kMaxTerrainHeight * fractal_noise({x, y, 0.5 * kHillDistance}, kHillDistance, kOctaves, seed);
      for (const double coordinate : {x, y, height}) mesh.vertices.push_back(static_cast<float>(coordinate));
    }
  }
  for (uint64_t row = 0; row < rows; ++row) {
    for (uint64_t column = 0; column < columns; ++column) {
      const auto a = static_cast<uint32_t>(row * (columns + 1) + column);
      const auto b = static_cast<uint32_t>(a + columns + 1);
      for (const uint32_t index : {a, a + 1, b + 1, a, b + 1, b}) mesh.indices.push_back(index);
    }
  }
  return mesh;
}

}  // namespace locus::cli
