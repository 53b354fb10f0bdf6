// Error of the importers for an exceeded limit. The error's message names the limit. A pure function.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_IMPORT_ERROR_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_IMPORT_ERROR_H_

#include <cstdint>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace locus::cli {

// Returns RESOURCE_EXHAUSTED: "`what` has `has`, the limit NAME is VALUE: `remedy`". For example what = "the archive",
// has = "70000 entries", name = "archive_entries".
absl::Status exceeds(absl::string_view what, absl::string_view has, absl::string_view name, uint64_t value,
                     absl::string_view remedy);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_IMPORT_ERROR_H_
