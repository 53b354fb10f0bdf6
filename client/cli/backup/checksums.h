// Contents of the file SHA256SUMS of a backup, in the format of coreutils, so that `sha256sum -c SHA256SUMS` checks a
// backup without locus. Plain data and functions without state.
#ifndef LOCUS_CLIENT_CLI_BACKUP_CHECKSUMS_H_
#define LOCUS_CLIENT_CLI_BACKUP_CHECKSUMS_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/lib/sha256.h"

namespace locus::cli {

inline constexpr char kChecksumFile[] = "SHA256SUMS";

struct Checksum {
  std::string path;
  client::Sha256 sha256 = {};

  bool operator==(const Checksum&) const = default;
};

// Returns one line per file: the file's SHA-256 in lower case hexadecimal, two spaces, the file's path.
std::string checksum_text(const std::vector<Checksum>& checksums);

// Parses a text in the format of checksum_text(). Returns DATA_LOSS, with the number of the line, if a line deviates
// from this format in any byte, or if client::BackupPaths refuses the line's path, for example because the path is
// repeated or leads out of the backup.
absl::StatusOr<std::vector<Checksum>> parse_checksums(absl::string_view text);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_BACKUP_CHECKSUMS_H_
