// Texts of untrusted files, made safe to print and to send. For the importers. A pure function.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_CLEAN_TEXT_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_CLEAN_TEXT_H_

#include <cstddef>
#include <string>

#include "absl/strings/string_view.h"

namespace locus::cli {

// Returns `raw` truncated to `max_bytes` at a character boundary, with control characters replaced by '_', since a
// terminal would interpret them. If `raw` is not valid UTF-8, which a protobuf string must be, every byte outside ASCII
// is replaced by '_'.
std::string clean_text(absl::string_view raw, size_t max_bytes);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_CLEAN_TEXT_H_
