#include "client/cli/levels/import/import_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "tests/client/cli/levels/import/test_files.h"

namespace locus::cli {
namespace {

using ::testing::HasSubstr;

std::string message(const absl::StatusOr<ImportedLevel>& level) { return std::string(level.status().message()); }

TEST(ImportFileTest, AnUnknownTypeIsNamedWithAListOfTheSupportedTypes) {
  const TempFolder folder;
  const auto level = import_file(folder.write("model.FBX", "x"), {});
  EXPECT_EQ(level.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(message(level), "unsupported file type .fbx: give OBJ, PLY, STL, GLB/glTF, BSP or PK3");
}

TEST(ImportFileTest, MissingFileIsNotFoundForEveryType) {
  const TempFolder folder;
  for (const char* name : {"a.obj", "a.ply", "a.stl", "a.gltf", "a.glb", "a.bsp", "a.pk3"}) {
    EXPECT_EQ(import_file(folder.path(name), {}).status().code(), absl::StatusCode::kNotFound) << name;
  }
}

TEST(ImportFileTest, EmptyFileAndFolderAreRefused) {
  const TempFolder folder;
  EXPECT_THAT(message(import_file(folder.write("a.obj", ""), {})), HasSubstr("is empty"));
  std::filesystem::create_directory(folder.path("b.obj"));
  EXPECT_THAT(message(import_file(folder.path("b.obj"), {})), HasSubstr("is not a file"));
}

TEST(ImportFileTest, RandomBytesAreRefusedForEveryType) {
  const TempFolder folder;
  std::string noise;
  for (int i = 0; i < 4000; ++i) noise.push_back(static_cast<char>((i * 7919 + i * i) >> 3));
  for (const char* name : {"a.obj", "a.ply", "a.stl", "a.gltf", "a.glb", "a.bsp", "a.pk3"}) {
    EXPECT_EQ(import_file(folder.write(name, noise), {}).status().code(), absl::StatusCode::kInvalidArgument) << name;
  }
}

TEST(ImportFileTest, BadOptionsAreRefusedByName) {
  const TempFolder folder;
  const std::string path = folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  for (double scale : {0.0, -1.0, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THAT(message(import_file(path, {.entry = "", .scale = scale})), HasSubstr("scale")) << scale;
  }
  for (int subdivisions : {-1, 0, 65}) {
    EXPECT_THAT(message(import_file(path, {.entry = "", .patch_subdivisions = subdivisions})),
                HasSubstr("patch subdivisions"));
  }
  EXPECT_THAT(message(import_file(path, {.entry = "maps/a.bsp"})), HasSubstr("for .pk3 archives only"));
}

TEST(ImportFileTest, ExtensionIsReadInAnyCase) {
  const TempFolder folder;
  const auto level = import_file(folder.write("A.OBJ", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), {});
  ASSERT_TRUE(level.ok()) << level.status();
  EXPECT_EQ(level->source_format, "OBJ");
  EXPECT_EQ(level->meshes.at(0).name, "A");
}

}  // namespace
}  // namespace locus::cli
