// Files of contexts, tokens, keys and certificates. By default only the owner may read a new file. If writing fails, no
// partial file remains. Functions without state; a FileLock belongs to one thread.
#ifndef LOCUS_CLIENT_CLI_SECURITY_PRIVATE_FILE_H_
#define LOCUS_CLIENT_CLI_SECURITY_PRIVATE_FILE_H_

#include <sys/types.h>

#include <cstddef>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace locus::cli {

inline constexpr size_t kMaxSecurityFileBytes = size_t{1} << 20;
inline constexpr mode_t kPrivateMode = 0600;
inline constexpr mode_t kPublicMode = 0644;

// Text and mode of a file.
struct SecurityFile {
  std::string text;
  mode_t mode = kPrivateMode;
};

// Returns the file's text and mode. Returns NOT_FOUND if there is no such file, FAILED_PRECONDITION if the file cannot
// be read or is larger than kMaxSecurityFileBytes.
absl::StatusOr<SecurityFile> read_security_file(const std::string& path);

// Creates a file and syncs it to disk. Returns ALREADY_EXISTS, without a change, if the file exists.
absl::Status create_security_file(const std::string& path, const SecurityFile& content);

// Replaces the file, or creates it if it does not exist. Readers see either the old or the new content. The new file
// has the owner and the group of the old file. Returns FAILED_PRECONDITION, without a change, if this process is not
// permitted to set owner and group.
absl::Status replace_security_file(const std::string& path, const SecurityFile& content);

// Lock of the file PATH against other writers: an flock() of the file PATH.lock, which is never deleted. The destructor
// releases the lock.
class FileLock {
 public:
  // Waits until no other process holds the lock.
  static absl::StatusOr<FileLock> acquire(const std::string& path);
  FileLock(FileLock&& other) noexcept;
  FileLock& operator=(FileLock&&) = delete;
  ~FileLock();

 private:
  explicit FileLock(int descriptor) : descriptor_(descriptor) {}
  int descriptor_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SECURITY_PRIVATE_FILE_H_
