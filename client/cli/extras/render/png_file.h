// Writer of pictures as PNG files. For `locus render`. Functions without state.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_RENDER_PNG_FILE_H_
#define LOCUS_CLIENT_CLI_EXTRAS_RENDER_PNG_FILE_H_

#include <string>

#include "absl/status/status.h"
#include "client/cli/extras/render/picture.h"

namespace locus::cli {

// Returns FAILED_PRECONDITION if `path` does not end in .png, if it is a folder, or if its parent folder does not
// exist. Call it before the picture is computed, which takes long.
absl::Status check_png_path(const std::string& path);

// Writes a PNG in sRGB with 8 bits per channel. Replaces an existing file. Returns FAILED_PRECONDITION if the file
// cannot be written.
absl::Status write_png(const std::string& path, const Picture& picture);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_RENDER_PNG_FILE_H_
