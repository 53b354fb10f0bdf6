#include "client/cli/levels/import/level_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

#include "client/cli/levels/import/import_file.h"
#include "tests/client/cli/levels/import/test_files.h"

namespace locus::cli {
namespace {

namespace fs = std::filesystem;

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Returns a glTF file with one triangle, whose bytes are in the file that `uri` refers to.
std::string gltf(const std::string& uri) {
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
         R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],)"
         R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],)"
         R"("bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":")" +
         uri + R"("}]})";
}

std::string triangle_bytes() {
  std::string bytes;
  for (float value : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f}) append_f32(bytes, value);
  return bytes;
}

class LevelFilesTest : public ::testing::Test {
 protected:
  absl::StatusOr<ImportedLevel> import_reference(const std::string& uri) {
    return import_file(folder_.write("level/a.gltf", gltf(uri)), {});
  }
  void SetUp() override {
    fs::create_directories(folder_.path("level/sub"));
    folder_.write("outside.bin", triangle_bytes());
    folder_.write("level/a.bin", triangle_bytes());
    folder_.write("level/sub/my b.bin", triangle_bytes());
  }

  TempFolder folder_;
};

TEST_F(LevelFilesTest, BuffersInTheFolderAndBelowItAreRead) {
  for (const char* uri : {"a.bin", "./a.bin", "sub/my%20b.bin"}) {
    const auto level = import_reference(uri);
    ASSERT_TRUE(level.ok()) << uri << ": " << level.status();
    EXPECT_EQ(level->meshes.at(0).indices.size(), 3u);
  }
}

TEST_F(LevelFilesTest, BuffersWithinTheFileAreRead) {
  const auto level =
      import_reference("data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA");
  ASSERT_TRUE(level.ok()) << level.status();
  EXPECT_EQ(level->meshes.at(0).indices.size(), 3u);
}

TEST_F(LevelFilesTest, ReferencesOutOfTheFolderAreRefused) {
  for (const std::string& uri : {std::string("../outside.bin"), folder_.path("outside.bin")}) {
    const auto level = import_reference(uri);
    EXPECT_EQ(level.status().code(), absl::StatusCode::kInvalidArgument) << uri;
    EXPECT_THAT(std::string(level.status().message()), HasSubstr("no relative path below the file's folder"));
  }
}

TEST_F(LevelFilesTest, LinksOutOfTheFolderAreRefused) {
  fs::create_symlink(folder_.path("outside.bin"), folder_.path("level/link.bin"));
  fs::create_directory_symlink(folder_.path(""), folder_.path("level/up"));
  for (const char* uri : {"link.bin", "up/outside.bin"}) {
    const auto level = import_reference(uri);
    EXPECT_EQ(level.status().code(), absl::StatusCode::kInvalidArgument) << uri;
    EXPECT_THAT(std::string(level.status().message()), HasSubstr("a link that leads out of the file's folder"));
  }
}

TEST_F(LevelFilesTest, LinksWithinTheFolderAreFollowed) {
  fs::create_symlink("a.bin", folder_.path("level/link.bin"));
  EXPECT_TRUE(import_reference("link.bin").ok());
}

TEST_F(LevelFilesTest, AMissingFileAndAFolderAreRefusedByName) {
  EXPECT_EQ(import_reference("none.bin").status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(import_reference("none.bin").status().message()),
              HasSubstr("the file refers to none.bin, which cannot be opened: No such file or directory"));
  EXPECT_THAT(std::string(import_reference("sub").status().message()), HasSubstr("is not a file"));
}

TEST_F(LevelFilesTest, ANamedPipeIsRefusedAndNotOpened) {
  ASSERT_EQ(mkfifo(folder_.path("level/pipe").c_str(), 0600), 0);
  EXPECT_THAT(std::string(import_reference("pipe").status().message()), HasSubstr("is not a file"));
}

TEST_F(LevelFilesTest, TheMaterialsOfAnObjFileAreNotRead) {
  folder_.write("level/m.mtl", "newmtl red\nKd 1 0 0\n");
  const std::string faces = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\nusemtl blue\nf 1 3 2\n";
  for (const char* library : {"m.mtl", "../m.mtl", "/etc/passwd", "none.mtl"}) {
    const std::string path = folder_.write("level/a.obj", std::string("mtllib ") + library + "\n" + faces);
    const auto files = read_level_files(path);
    ASSERT_TRUE(files.ok()) << files.status();
    EXPECT_THAT(files->referenced, IsEmpty());
    const auto level = import_file(path, {});
    ASSERT_TRUE(level.ok()) << level.status();
    EXPECT_EQ(level->meshes.at(0).indices.size(), 6u);
  }
}

TEST_F(LevelFilesTest, AFileThatIsGivenWithoutAFolderFindsItsBuffers) {
  folder_.write("level/a.gltf", gltf("a.bin"));
  const fs::path before = fs::current_path();
  fs::current_path(folder_.path("level"));
  const auto files = read_level_files("a.gltf");
  fs::current_path(before);
  ASSERT_TRUE(files.ok()) << files.status();
  EXPECT_EQ(files->name, "a.gltf");
  EXPECT_THAT(files->referenced, Contains(std::pair<const std::string, std::string>("a.bin", triangle_bytes())));
}

}  // namespace
}  // namespace locus::cli
