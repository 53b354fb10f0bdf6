// Writes pictures as PNG files. For `locus render`. Functions without state.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_RENDER_PNG_FILE_H_
#define LOCUS_CLIENT_CLI_EXTRAS_RENDER_PNG_FILE_H_

#include <string>

#include "absl/status/status.h"
#include "client/cli/extras/render/picture.h"

namespace locus::cli {

// FAILED_PRECONDITION, in words, where a file of this name cannot be: to be asked before work is put into a picture.
absl::Status check_png_path(const std::string& path);

// 8 bits a colour, sRGB, replacing a file of that name. FAILED_PRECONDITION where it cannot be written.
absl::Status write_png(const std::string& path, const Picture& picture);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_RENDER_PNG_FILE_H_
