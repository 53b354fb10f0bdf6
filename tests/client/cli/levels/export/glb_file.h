// Reader of GLB files that checks their structure, for tests of the exporter. Functions without state.
#ifndef LOCUS_TESTS_CLIENT_CLI_LEVELS_EXPORT_GLB_FILE_H_
#define LOCUS_TESTS_CLIENT_CLI_LEVELS_EXPORT_GLB_FILE_H_

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "client/cli/output.h"

namespace locus::cli::testing {

inline uint32_t number_at(const std::string& bytes, size_t offset) {
  uint32_t value = 0;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

struct GlbFile {
  Json json;
  std::string binary;

  // Returns the values of an accessor: three per position, one per index.
  template <class T>
  std::vector<T> column(size_t accessor) const {
    const Json& entry = json["accessors"][accessor];
    const Json& view = json["bufferViews"][entry["bufferView"].get<size_t>()];
    std::vector<T> values(entry["count"].get<size_t>() * (entry["type"] == "VEC3" ? 3 : 1));
    std::memcpy(values.data(), binary.data() + view["byteOffset"].get<size_t>(), values.size() * sizeof(T));
    return values;
  }
  size_t triangles(size_t mesh) const {
    size_t indices = 0;
    for (const Json& primitive : json["meshes"][mesh]["primitives"])
      indices += json["accessors"][primitive["indices"].get<size_t>()]["count"].get<size_t>();
    return indices / 3;
  }
  const Json& node(const std::string& name) const {
    const Json& nodes = json["nodes"];
    const auto found = std::find_if(nodes.begin(), nodes.end(), [&](const Json& node) { return node["name"] == name; });
    EXPECT_NE(found, nodes.end()) << "no node is named " << name;
    return found == nodes.end() ? nodes[0] : *found;
  }
};

inline void expect_accessor_true(const GlbFile& file, const Json& primitive) {
  const Json& positions = file.json["accessors"][primitive["attributes"]["POSITION"].get<size_t>()];
  const std::vector<float> vertices = file.column<float>(primitive["attributes"]["POSITION"].get<size_t>());
  for (size_t axis = 0; axis < 3; ++axis) {
    float low = vertices[axis];
    float high = vertices[axis];
    for (size_t i = axis; i < vertices.size(); i += 3) {
      low = std::min(low, vertices[i]);
      high = std::max(high, vertices[i]);
    }
    EXPECT_EQ(positions["min"][axis].get<float>(), low);
    EXPECT_EQ(positions["max"][axis].get<float>(), high);
  }
  const std::vector<uint32_t> indices = file.column<uint32_t>(primitive["indices"].get<size_t>());
  EXPECT_LT(*std::max_element(indices.begin(), indices.end()), vertices.size() / 3);
  EXPECT_EQ(indices.size() % 3, 0u);
}

// Expects that a file is valid: it has one buffer, views are within the buffer, accessors are within their views and
// have exact bounds, and every node except the root has exactly one parent.
inline void expect_valid(const GlbFile& file) {
  EXPECT_EQ(file.json["asset"]["version"], "2.0");
  ASSERT_EQ(file.json["buffers"].size(), 1u);
  EXPECT_EQ(file.json["buffers"][0]["byteLength"].get<size_t>(), file.binary.size());
  for (const Json& accessor : file.json["accessors"]) {
    const Json& view = file.json["bufferViews"].at(accessor["bufferView"].get<size_t>());
    const size_t row = accessor["type"] == "VEC3" ? 12 : 4;
    EXPECT_EQ(accessor["count"].get<size_t>() * row, view["byteLength"].get<size_t>());
    EXPECT_LE(view["byteOffset"].get<size_t>() + view["byteLength"].get<size_t>(), file.binary.size());
    EXPECT_EQ(view["byteOffset"].get<size_t>() % 4, 0u);
  }
  for (const Json& mesh : file.json["meshes"]) {
    ASSERT_FALSE(mesh["primitives"].empty());
    for (const Json& primitive : mesh["primitives"]) {
      EXPECT_LT(primitive["material"].get<size_t>(), file.json["materials"].size());
      expect_accessor_true(file, primitive);
    }
  }
  std::vector<int> parents(file.json["nodes"].size());
  for (const Json& node : file.json["nodes"]) {
    if (node.contains("mesh")) {
      EXPECT_LT(node["mesh"].get<size_t>(), file.json["meshes"].size());
    }
    if (!node.contains("children")) continue;
    for (const Json& child : node["children"]) ++parents.at(child.get<size_t>());
  }
  EXPECT_EQ(parents[0], 0);
  EXPECT_EQ(std::count(parents.begin() + 1, parents.end(), 1), static_cast<int64_t>(parents.size()) - 1);
}

inline GlbFile read_glb(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  const std::string bytes = text.str();
  GlbFile file;
  EXPECT_GE(bytes.size(), 28u) << path;
  if (bytes.size() < 28) return file;
  EXPECT_EQ(bytes.substr(0, 4), "glTF");
  EXPECT_EQ(number_at(bytes, 4), 2u);
  EXPECT_EQ(number_at(bytes, 8), bytes.size());
  const size_t json_bytes = number_at(bytes, 12);
  EXPECT_EQ(json_bytes % 4, 0u);
  EXPECT_EQ(bytes.substr(16, 4), "JSON");
  EXPECT_EQ(number_at(bytes, 20 + json_bytes), bytes.size() - 28 - json_bytes);
  EXPECT_EQ(bytes.substr(24 + json_bytes, 4), std::string("BIN\0", 4));
  file.json = Json::parse(bytes.substr(20, json_bytes), nullptr, /*allow_exceptions=*/false);
  EXPECT_FALSE(file.json.is_discarded());
  file.binary = bytes.substr(28 + json_bytes);
  return file;
}

}  // namespace locus::cli::testing

#endif  // LOCUS_TESTS_CLIENT_CLI_LEVELS_EXPORT_GLB_FILE_H_
