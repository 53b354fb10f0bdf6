// Writer of small Quake 3 levels for the tests, with arbitrary valid or invalid values in any field. Only one thread
// uses an object.
#ifndef LOCUS_TESTS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_BSP_WRITER_H_
#define LOCUS_TESTS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_BSP_WRITER_H_

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/client/cli/levels/import/test_files.h"

namespace locus::cli {

struct BspWriterFace {
  uint32_t texture = 0;
  uint32_t type = 1;
  uint32_t first_vertex = 0;
  uint32_t vertex_count = 0;
  uint32_t first_meshvert = 0;
  uint32_t meshvert_count = 0;
  uint32_t width = 0;
  uint32_t height = 0;
};

struct BspWriter {
  uint32_t version = 46;
  std::vector<std::string> textures;
  std::vector<std::array<float, 3>> vertices;
  std::vector<uint32_t> meshverts;
  std::vector<BspWriterFace> faces;

  std::string bytes() const {
    std::array<std::string, 17> lumps;
    lumps[0] = "{ \"classname\" \"worldspawn\" }";
    for (const std::string& texture : textures) {
      std::string record = texture;
      record.resize(72);
      lumps[1] += record;
    }
    for (const std::array<float, 3>& vertex : vertices) {
      for (float coordinate : vertex) append_f32(lumps[10], coordinate);
      lumps[10].append(32, '\0');
    }
    for (uint32_t meshvert : meshverts) append_u32(lumps[11], meshvert);
    for (const BspWriterFace& face : faces) append_face(lumps[13], face);

    std::string head = "IBSP";
    append_u32(head, version);
    std::string body;
    for (const std::string& lump : lumps) {
      append_u32(head, static_cast<uint32_t>(144 + body.size()));
      append_u32(head, static_cast<uint32_t>(lump.size()));
      body += lump;
    }
    return head + body;
  }

 private:
  static void append_face(std::string& lump, const BspWriterFace& face) {
    const size_t start = lump.size();
    for (uint32_t value : {face.texture, UINT32_MAX, face.type, face.first_vertex, face.vertex_count,
                           face.first_meshvert, face.meshvert_count}) {
      append_u32(lump, value);
    }
    lump.resize(start + 96);
    append_u32(lump, face.width);
    append_u32(lump, face.height);
  }
};

// Returns a level of one polygon (2 triangles, texture floor), one mesh face (1 triangle, texture crate), one flat 3 x
// 3 patch (texture floor) and one billboard. The polygon is in the plane z = 0, the mesh face in z = 1 and the patch in
// z = 2; all three face +z.
inline BspWriter small_level() {
  BspWriter level;
  level.textures = {"textures/floor", "models/crate"};
  level.vertices = {{0, 0, 0}, {0, 8, 0}, {8, 8, 0}, {8, 0, 0}, {0, 0, 1}, {0, 4, 1}, {4, 0, 1}};
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 3; ++x) level.vertices.push_back({static_cast<float>(x) * 3, static_cast<float>(y) * 3, 2});
  }
  level.meshverts = {0, 1, 2, 0, 2, 3, 0, 1, 2};
  level.faces = {
      {.texture = 0, .type = 1, .first_vertex = 0, .vertex_count = 4, .meshvert_count = 6},
      {.texture = 1, .type = 3, .first_vertex = 4, .vertex_count = 3, .first_meshvert = 6, .meshvert_count = 3},
      {.texture = 0, .type = 2, .first_vertex = 7, .vertex_count = 9, .width = 3, .height = 3},
      {.texture = 0, .type = 4, .first_vertex = 0, .vertex_count = 0}};
  return level;
}

}  // namespace locus::cli

#endif  // LOCUS_TESTS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_BSP_WRITER_H_
