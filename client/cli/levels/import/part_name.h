// Sanitizing of names from untrusted files, so that they can be sent and printed. A function without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_PART_NAME_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_PART_NAME_H_

#include <string>

#include "absl/strings/string_view.h"

namespace locus::cli {

// Returns `raw` truncated to kMaxPartNameBytes at a character boundary, with control characters replaced by '_'. If
// `raw` is not valid UTF-8, which a protobuf string must be, every byte outside ASCII is replaced by '_'.
std::string clean_part_name(absl::string_view raw);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_PART_NAME_H_
