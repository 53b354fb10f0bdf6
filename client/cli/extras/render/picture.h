// Picture in memory, in the pixel layout of a PNG file, and the writer of that file. Plain data and functions without
// state.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_RENDER_PICTURE_H_
#define LOCUS_CLIENT_CLI_EXTRAS_RENDER_PICTURE_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/cli/extras/render/camera.h"

namespace locus::cli {

// Colour of a pixel in sRGB.
struct Colour {
  uint8_t red = 0, green = 0, blue = 0;

  friend bool operator==(const Colour&, const Colour&) = default;
};
static_assert(sizeof(Colour) == 3, "rows of colours are rows of a PNG");

struct Picture {
  ImageSize size;
  std::vector<Colour> pixels;  // row by row from the upper left
};

// Returns FAILED_PRECONDITION if `path` does not end in .png, if it is a folder, or if its parent folder does not
// exist. Commands call this function first, because computing the picture takes long.
absl::Status check_png_path(const std::string& path);

// Writes a PNG in sRGB with 8 bits per channel. Replaces an existing file. Returns FAILED_PRECONDITION if the file
// cannot be written.
absl::Status write_png(const std::string& path, const Picture& picture);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_RENDER_PICTURE_H_
