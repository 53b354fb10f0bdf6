// Decoder of the drawn surfaces in a Quake 3 level file (IBSP version 46). For the BSP importer. Plain data and a
// function without state. A meshvert is an entry of the file's list of triangle corners: a vertex index relative to the
// face's first vertex. Invariants of a BspFile returned by parse_bsp(): every float is finite; the texture index of
// every face, the vertex indices of every face except billboards, and the meshvert indices of polygons and meshes are
// in range.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_BSP_FILE_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_BSP_FILE_H_

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace locus::cli {

enum class BspFaceType { kPolygon = 1, kPatch = 2, kMesh = 3, kBillboard = 4 };

struct BspFace {
  BspFaceType type = BspFaceType::kPolygon;
  uint32_t texture = 0;
  uint32_t first_vertex = 0;
  uint32_t vertex_count = 0;
  uint32_t first_meshvert = 0;  // polygons and meshes only
  uint32_t meshvert_count = 0;  // polygons and meshes only: a multiple of 3
  uint32_t patch_width = 0;     // patches only: odd, at least 3, width * height = vertex_count
  uint32_t patch_height = 0;
};

struct BspFile {
  std::vector<std::string> textures;
  std::vector<std::array<float, 3>> vertices;
  std::vector<uint32_t> meshverts;  // triangle corners: vertex indices, relative to the face's first vertex
  std::vector<BspFace> faces;
};

// Decodes `bytes`, the untrusted content of a whole file. Returns INVALID_ARGUMENT for a damaged file; the message
// names the damaged lump and element. Cost: linear in the file's size.
absl::StatusOr<BspFile> parse_bsp(absl::string_view bytes);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_BSP_FILE_H_
