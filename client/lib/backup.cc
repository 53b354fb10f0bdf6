#include "client/lib/backup.h"

#include <algorithm>
#include <cassert>
#include <vector>

#include "absl/strings/str_split.h"
#include "core/base/status_macros.h"

namespace locus::client {
namespace {

// Returns whether a path may contain `byte`. All bytes of multi-byte UTF-8 characters are allowed. The backslash is not
// allowed, because checksum files would have to escape it.
bool is_printable(char byte) {
  const auto code = static_cast<unsigned char>(byte);
  return code >= 0x20 && code != 0x7F && byte != '\\';
}

absl::Status check(const std::string& path) {
  if (path.empty()) return absl::InvalidArgumentError("is empty");
  if (path.size() > kMaxBackupPathLength) return absl::InvalidArgumentError("is too long");
  if (!std::all_of(path.begin(), path.end(), is_printable))
    return absl::InvalidArgumentError("has a character that a path may not have");
  const std::vector<absl::string_view> names = absl::StrSplit(path, '/');
  const bool leads_away = std::any_of(
      names.begin(), names.end(), [](absl::string_view name) { return name.empty() || name == "." || name == ".."; });
  return leads_away ? absl::InvalidArgumentError("leads out of its directory") : absl::OkStatus();
}

}  // namespace

absl::Status BackupPaths::add(const std::string& path) {
  RETURN_IF_ERROR(check(path));
  if (files_.size() >= kMaxBackupFiles) return absl::InvalidArgumentError("is one more than a backup may have");
  if (folders_.contains(path)) return absl::InvalidArgumentError("is a folder of another file");
  for (size_t slash = path.find('/'); slash != std::string::npos; slash = path.find('/', slash + 1)) {
    const std::string folder = path.substr(0, slash);
    if (files_.contains(folder)) return absl::InvalidArgumentError("is below a path that is a file");
    folders_.insert(folder);
    if (folders_.size() > kMaxBackupFiles) return absl::InvalidArgumentError("has more folders than a backup may have");
  }
  const bool added = files_.insert(path).second;
  assert(check_invariants(path));
  return added ? absl::OkStatus() : absl::InvalidArgumentError("comes twice");
}

bool BackupPaths::check_invariants(const std::string& path) const {
  bool holds = files_.contains(path) && !folders_.contains(path);
  for (size_t slash = path.find('/'); slash != std::string::npos; slash = path.find('/', slash + 1)) {
    const std::string folder = path.substr(0, slash);
    holds = holds && folders_.contains(folder) && !files_.contains(folder);
  }
  return holds;
}

}  // namespace locus::client
