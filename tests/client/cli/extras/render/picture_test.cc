#include "client/cli/extras/render/picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <filesystem>
#include <string>

namespace locus::cli {
namespace {

using ::testing::HasSubstr;

std::string path_of(const std::string& name) { return ::testing::TempDir() + "/" + name; }

Picture gradient(const ImageSize& size) {
  Picture picture{size, {}};
  for (uint32_t row = 0; row < size.height; ++row)
    for (uint32_t column = 0; column < size.width; ++column)
      picture.pixels.push_back({static_cast<uint8_t>(column), static_cast<uint8_t>(row), 200});
  return picture;
}

// Reads a PNG file back with libpng.
Picture read_png(const std::string& path) {
  png_image image = {};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&image, path.c_str()) == 0) {
    ADD_FAILURE() << image.message;
    return {};
  }
  EXPECT_EQ(image.format, static_cast<png_uint_32>(PNG_FORMAT_RGB));
  image.format = PNG_FORMAT_RGB;
  Picture picture{{image.width, image.height}, {}};
  picture.pixels.resize(picture.size.pixels());
  EXPECT_NE(png_image_finish_read(&image, nullptr, picture.pixels.data(), 0, nullptr), 0) << image.message;
  return picture;
}

TEST(PngFileTest, APictureIsReadBackAsItWasWritten) {
  const std::string path = path_of("gradient.png");
  for (const ImageSize size : {ImageSize{37, 11}, ImageSize{1, 1}, ImageSize{256, 3}}) {
    const Picture picture = gradient(size);
    ASSERT_TRUE(write_png(path, picture).ok());
    const Picture read = read_png(path);
    EXPECT_EQ(read.size, size);
    EXPECT_EQ(read.pixels, picture.pixels);
  }
  std::filesystem::remove(path);
}

TEST(PngFileTest, AnUnwritablePathIsNamed) {
  const absl::Status status = write_png("/nonexistent/folder/x.png", gradient({2, 2}));
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(status.message(), HasSubstr("cannot write /nonexistent/folder/x.png"));
}

TEST(PngFileTest, AFullDiskIsAnError) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  EXPECT_THAT(write_png("/dev/full", gradient({64, 64})).message(), HasSubstr("cannot write /dev/full"));
}

TEST(PngPathTest, PathsInExistingFoldersAreAccepted) {
  EXPECT_TRUE(check_png_path("here.png").ok());
  EXPECT_TRUE(check_png_path(path_of("there.PNG")).ok());
}

TEST(PngPathTest, AnotherEndingIsRefused) {
  EXPECT_THAT(check_png_path("picture.jpg").message(), HasSubstr("picture.jpg does not end in .png"));
}

TEST(PngPathTest, AMissingFolderIsNamed) {
  EXPECT_THAT(check_png_path("/nonexistent/x.png").message(), HasSubstr("there is no folder /nonexistent"));
}

TEST(PngPathTest, AFolderIsRefused) {
  const std::string folder = path_of("folder.png");
  std::filesystem::create_directory(folder);
  EXPECT_THAT(check_png_path(folder).message(), HasSubstr("it is a folder"));
  std::filesystem::remove(folder);
}

}  // namespace
}  // namespace locus::cli
