#include "server/storage/rocksdb/errors.h"

#include <memory>

#include "absl/strings/str_cat.h"
#include "core/base/refusal.h"

namespace locus::server {
namespace {

constexpr uint32_t kRetryAfterMs = 1000;

// Returns RESOURCE_EXHAUSTED with `message`. `needed_bytes` and `free_bytes` are 0 if they are unknown.
absl::Status full_disk(absl::string_view message, uint64_t needed_bytes, uint64_t free_bytes) {
  Refusal refusal;
  refusal.reason = Reason::kLimit;
  refusal.limit = "disk_bytes";
  refusal.limit_value = static_cast<double>(free_bytes);
  refusal.asked = static_cast<double>(needed_bytes);
  refusal.retry_after_ms = kRetryAfterMs;
  return refuse(absl::StatusCode::kResourceExhausted, message, refusal);
}

bool is_full(const rocksdb::Status& status) {
  return status.IsNoSpace() || status.subcode() == rocksdb::Status::SubCode::kSpaceLimit;
}

}  // namespace

absl::Status disk_error(absl::string_view doing, const rocksdb::Status& status) {
  const std::string message = absl::StrCat(doing, ": ", status.ToString());
  if (is_full(status))
    return full_disk(absl::StrCat(message, "; free some disk space, and writing resumes within seconds"), 0, 0);
  if (status.IsCorruption()) return absl::DataLossError(message);
  return absl::UnavailableError(message);
}

absl::Status read_error(absl::string_view doing, const rocksdb::Status& status) {
  if (status.IsPathNotFound()) return absl::DataLossError(absl::StrCat(doing, ": ", status.ToString()));
  return disk_error(doing, status);
}

absl::Status refuse_full_disk(absl::string_view what, uint64_t bytes, uint64_t reserve_bytes, uint64_t free_bytes) {
  const uint64_t needed = reserve_bytes + bytes;
  return full_disk(absl::StrCat(what, " needs ", needed, " free bytes on the disk, including ", reserve_bytes,
                                " reserved for snapshots and recovery; the disk has ", free_bytes,
                                ": free some disk space, and writing resumes within seconds"),
                   needed, free_bytes);
}

absl::Status refuse_recovery(uint64_t needed_bytes, uint64_t free_bytes) {
  return full_disk(absl::StrCat("writing the log stopped after an error of the disk: resuming needs ", needed_bytes,
                                " free bytes, and the disk has ", free_bytes,
                                "; free some disk space, and writing resumes within seconds"),
                   needed_bytes, free_bytes);
}

bool is_damage(const rocksdb::Status& status) {
  if (status.ok() || is_full(status) || status.IsBusy() || status.IsTimedOut() || status.IsAborted() ||
      status.IsMemoryLimit() || status.IsShutdownInProgress())
    return false;
  if (status.IsPathNotFound()) return true;  // a file is missing that RocksDB lists as its own
  return !status.IsIOError();
}

rocksdb::Status sync_folder(rocksdb::Env& env, const std::string& folder) {
  std::unique_ptr<rocksdb::Directory> directory;
  rocksdb::Status status = env.NewDirectory(folder, &directory);
  if (status.ok()) status = directory->Fsync();
  return status;
}

}  // namespace locus::server
