// Files for the import tests: a temporary folder that is deleted at the end of the test, and functions that append
// little-endian numbers. Not thread-safe.
#ifndef LOCUS_TESTS_CLIENT_CLI_LEVELS_IMPORT_TEST_FILES_H_
#define LOCUS_TESTS_CLIENT_CLI_LEVELS_IMPORT_TEST_FILES_H_

#include <gtest/gtest.h>
#include <unistd.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>

#include "client/cli/levels/import/imported_mesh.h"

namespace locus::cli {

class TempFolder {
 public:
  TempFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "locus-import-XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) ADD_FAILURE() << "no temporary folder " << pattern;
    path_ = pattern;
  }
  ~TempFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;

  std::string path(const std::string& name) const { return (path_ / name).string(); }

  // Writes a file `name` into the folder and returns its path.
  std::string write(const std::string& name, const std::string& bytes) const {
    std::ofstream file(path(name), std::ios::binary);
    file << bytes;
    EXPECT_TRUE(file.good()) << path(name);
    return path(name);
  }

 private:
  std::filesystem::path path_;
};

inline void append_u32(std::string& bytes, uint32_t value) {
  for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<char>(value >> shift & 0xFF));
}

inline void append_f32(std::string& bytes, float value) { append_u32(bytes, std::bit_cast<uint32_t>(value)); }

inline void expect_sound(const ImportedLevel& level) {
  for (const ImportedMesh& mesh : level.meshes) {
    ASSERT_EQ(mesh.vertices.size() % 3, 0u);
    ASSERT_EQ(mesh.indices.size() % 3, 0u);
    for (float coordinate : mesh.vertices) ASSERT_TRUE(std::isfinite(coordinate));
    for (uint32_t index : mesh.indices) ASSERT_LT(index, mesh.vertices.size() / 3);
    for (size_t i = 0; i < mesh.parts.size(); ++i) {
      ASSERT_LT(mesh.parts[i].first_triangle, mesh.indices.size() / 3);
      if (i == 0) continue;
      ASSERT_GT(mesh.parts[i].first_triangle, mesh.parts[i - 1].first_triangle);
    }
  }
}

}  // namespace locus::cli

#endif  // LOCUS_TESTS_CLIENT_CLI_LEVELS_IMPORT_TEST_FILES_H_
