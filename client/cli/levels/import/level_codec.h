// Binary form in which the child process of an import returns its result. For import_file(). Pure functions.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_LEVEL_CODEC_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_LEVEL_CODEC_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/cli/levels/import/imported_mesh.h"

namespace locus::cli {

// Returns the bytes of a level or of an error. Texts are truncated to kMaxImportTextBytes; only the first
// kMaxImportNotes notes are encoded.
std::string encode_level(const absl::StatusOr<ImportedLevel>& level);

// Returns the level or the error that encode_level() encoded. The bytes are untrusted, so they are checked: a returned
// level has the invariants of imported_mesh.h and is within the limits, and texts have no control characters. Returns
// INVALID_ARGUMENT for bytes that fail the check. Cost: linear.
absl::StatusOr<ImportedLevel> decode_level(absl::string_view bytes);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_LEVEL_CODEC_H_
