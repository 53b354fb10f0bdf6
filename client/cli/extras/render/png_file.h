// Writing of pictures as PNG files. For `locus render`. Functions without state.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_RENDER_PNG_FILE_H_
#define LOCUS_CLIENT_CLI_EXTRAS_RENDER_PNG_FILE_H_

#include <string>

#include "absl/status/status.h"
#include "client/cli/extras/render/picture.h"

namespace locus::cli {

// Returns FAILED_PRECONDITION if the path does not end in .png, its folder does not exist, or it is a folder. Call it
// before computing a picture.
absl::Status check_png_path(const std::string& path);

// Writes a PNG with 8 bits a channel, sRGB, and replaces an existing file. FAILED_PRECONDITION if it cannot be written.
absl::Status write_png(const std::string& path, const Picture& picture);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_RENDER_PNG_FILE_H_
