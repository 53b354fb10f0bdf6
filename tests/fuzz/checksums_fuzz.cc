// The file SHA256SUMS of a backup: an accepted text is parsed, and writing the result gives the same text. No path of
// an accepted text leads out of the backup.
#include "absl/strings/match.h"
#include "client/cli/backup/checksums.h"
#include "client/lib/backup.h"
#include "tests/fuzz/fuzz_target.h"

namespace locus::cli {
namespace {

LOCUS_FUZZ_TARGET(checksums) {
  const absl::StatusOr<std::vector<Checksum>> checksums = parse_checksums(input);
  if (!checksums.ok()) return fuzz::check_error(checksums.status());
  LOCUS_CHECK(checksum_text(*checksums) == input);
  for (const Checksum& one : *checksums) {
    LOCUS_CHECK_LE(one.path.size(), client::kMaxBackupPathLength);
    LOCUS_CHECK(!absl::StartsWith(one.path, "/") && !absl::StrContains("/" + one.path + "/", "/../"));
  }
}

}  // namespace
}  // namespace locus::cli
