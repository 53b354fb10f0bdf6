// The file SHA256SUMS of a backup, in the format of coreutils, so that `sha256sum -c SHA256SUMS` checks a backup
// without locus. Plain data and functions without state.
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

// A line a file: its hash in lower case, two spaces, its path.
std::string checksum_text(const std::vector<Checksum>& checksums);

// Nothing but what checksum_text() writes, so that no change of a byte goes unnoticed. DATA_LOSS naming the line at
// fault; so are paths that lead elsewhere or come twice.
absl::StatusOr<std::vector<Checksum>> parse_checksums(absl::string_view text);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_BACKUP_CHECKSUMS_H_
