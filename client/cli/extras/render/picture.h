// Picture in memory, in the pixel layout of a PNG file. Plain data.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_RENDER_PICTURE_H_
#define LOCUS_CLIENT_CLI_EXTRAS_RENDER_PICTURE_H_

#include <cstdint>
#include <vector>

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

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_RENDER_PICTURE_H_
