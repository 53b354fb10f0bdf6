// Makes names found in untrusted files fit to send and to print. A function without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_PART_NAME_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_PART_NAME_H_

#include <string>

#include "absl/strings/string_view.h"

namespace locus::cli {

// The name cut to kMaxPartNameBytes at a character's border, control characters replaced by '_', and every byte outside
// ASCII replaced by '_' if the whole is not valid UTF-8 (a protobuf string refuses anything else).
std::string clean_part_name(absl::string_view raw);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_PART_NAME_H_
