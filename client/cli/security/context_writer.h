// Writer of the file of named contexts, which client/lib/saved_contexts.h reads. Functions without state.
#ifndef LOCUS_CLIENT_CLI_SECURITY_CONTEXT_WRITER_H_
#define LOCUS_CLIENT_CLI_SECURITY_CONTEXT_WRITER_H_

#include <string>

#include "absl/status/status.h"
#include "client/lib/saved_contexts.h"

namespace locus::cli {

// Writes the contexts with mode 0600, and creates the file's folder if it does not exist.
absl::Status write_contexts(const std::string& path, const client::SavedContexts& contexts);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SECURITY_CONTEXT_WRITER_H_
