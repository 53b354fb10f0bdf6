#include "client/cli/security/context_writer.h"

#include <filesystem>
#include <system_error>

#include "client/cli/security/private_file.h"

namespace locus::cli {

absl::Status write_contexts(const std::string& path, const client::SavedContexts& contexts) {
  if (path.empty()) return absl::FailedPreconditionError("there is no folder for contexts: set HOME");
  std::error_code ignored;  // replace_security_file() reports a missing folder
  std::filesystem::create_directories(std::filesystem::path(path).parent_path(), ignored);
  return replace_security_file(path, {contexts_text(contexts), kPrivateMode});
}

}  // namespace locus::cli
