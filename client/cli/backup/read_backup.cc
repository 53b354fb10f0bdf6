#include "client/cli/backup/read_backup.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <map>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/backup/checksums.h"
#include "client/lib/sha256.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

namespace fs = std::filesystem;

constexpr size_t kReadBytes = size_t{1} << 20;
constexpr size_t kNamedProblems = 5;
// Maximum size of SHA256SUMS. The file has one line for each file of the backup: 64 hexadecimal digits, two spaces, the
// path and a line feed.
constexpr uint64_t kMaxChecksumBytes = client::kMaxBackupFiles * (client::kMaxBackupPathLength + 67);

// Collector of the damage found in a backup: counts the damaged files and stores the names of the first kNamedProblems
// of them.
class Problems {
 public:
  void add(absl::string_view path, absl::string_view what) {
    if (named_.size() < kNamedProblems) named_.push_back(absl::StrCat(path, " ", what));
    ++count_;
  }

  absl::Status status(const std::string& backup) const {
    if (count_ == 0) return absl::OkStatus();
    std::string text = absl::StrCat("the backup ", backup, " is damaged: ", absl::StrJoin(named_, ", "));
    if (count_ > named_.size()) absl::StrAppend(&text, " and ", count_ - named_.size(), " more");
    return absl::DataLossError(absl::StrCat(text, "; take another backup"));
  }

 private:
  std::vector<std::string> named_;
  size_t count_ = 0;
};

// Reads a file buffer by buffer and calls `take` with the contents of each buffer, until the file ends or `take`
// returns an error.
absl::Status read_file(const std::string& path, absl::FunctionRef<absl::Status(absl::string_view)> take) {
  const int file = open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC);
  if (file < 0) return file_error("read", path, errno);
  std::string buffer(kReadBytes, '\0');
  absl::Status status;
  while (status.ok()) {
    const ssize_t some = ::read(file, buffer.data(), buffer.size());
    if (some < 0 && errno == EINTR) continue;
    if (some < 0) status = file_error("read", path, errno);
    if (some <= 0) break;
    status = take(absl::string_view(buffer.data(), static_cast<size_t>(some)));
  }
  close(file);
  return status;
}

absl::StatusOr<std::vector<Checksum>> read_checksums(const std::string& backup) {
  const std::string path = absl::StrCat(backup, "/", kChecksumFile);
  std::string text;
  const absl::Status read = read_file(path, [&](absl::string_view bytes) {
    if (text.size() + bytes.size() > kMaxChecksumBytes)
      return absl::DataLossError(absl::StrCat(path, " is larger than that of any backup"));
    absl::StrAppend(&text, bytes);
    return absl::OkStatus();
  });
  if (absl::IsNotFound(read))
    return absl::NotFoundError(
        absl::StrCat(backup, " is no backup, or one that was interrupted: it has no ", kChecksumFile));
  RETURN_IF_ERROR(read);
  absl::StatusOr<std::vector<Checksum>> checksums = parse_checksums(text);
  if (checksums.ok()) return checksums;
  return absl::DataLossError(
      absl::StrCat("the backup ", backup, " is damaged: ", checksums.status().message(), "; take another backup"));
}

// Returns the size of every regular file below `backup` except SHA256SUMS, by relative path. Adds every other file that
// is not a folder to `problems`.
absl::StatusOr<std::map<std::string, uint64_t>> list_files(const std::string& backup, Problems& problems) {
  std::map<std::string, uint64_t> sizes;
  std::error_code why;
  fs::recursive_directory_iterator entry(backup, why);
  for (const fs::recursive_directory_iterator end; !why && entry != end; entry.increment(why)) {
    const std::string path = entry->path().lexically_relative(backup).generic_string();
    const fs::file_status status = entry->symlink_status(why);
    if (why) break;
    if (fs::is_directory(status) || path == kChecksumFile) continue;
    if (sizes.size() >= client::kMaxBackupFiles) {
      problems.add(path, "exceeds the maximum number of files");
      break;
    }
    if (fs::is_regular_file(status)) {
      sizes[path] = entry->file_size(why);
    } else {
      problems.add(path, "is no regular file");
    }
  }
  if (why) return file_error("read", backup, why.value());
  return sizes;
}

// Files of a backup to read, and their total size.
struct Contents {
  std::vector<Checksum> files;
  uint64_t bytes = 0;
};

// Returns the files that are both listed in SHA256SUMS and present in the backup. Adds every file that is only listed
// or only present to `problems`.
absl::StatusOr<Contents> find_files(const std::string& backup, Problems& problems) {
  ASSIGN_OR_RETURN(const std::vector<Checksum> checksums, read_checksums(backup));
  ASSIGN_OR_RETURN(auto sizes, list_files(backup, problems));
  Contents contents;
  for (const Checksum& one : checksums) {
    const auto found = sizes.find(one.path);
    if (found == sizes.end()) {
      problems.add(one.path, "is missing");
      continue;
    }
    contents.files.push_back(one);
    contents.bytes += found->second;
    sizes.erase(found);
  }
  for (const auto& [path, bytes] : sizes) problems.add(path, absl::StrCat("is not listed in ", kChecksumFile));
  return contents;
}

}  // namespace

absl::StatusOr<client::BackupSize> read_backup(const std::string& backup, PartialDirectory* copy,
                                               const BackupProgress& progress) {
  Problems problems;
  ASSIGN_OR_RETURN(const Contents contents, find_files(backup, problems));
  if (copy != nullptr) {
    RETURN_IF_ERROR(problems.status(backup));
    RETURN_IF_ERROR(copy->make(contents.bytes));
  }
  client::BackupSize done;
  client::Sha256Hasher hasher;
  const auto take = [&](absl::string_view bytes) {
    hasher.add(bytes);
    done.bytes += bytes.size();
    if (progress) progress(done.bytes, contents.bytes);
    return copy != nullptr ? copy->write(bytes) : absl::OkStatus();
  };
  for (const Checksum& one : contents.files) {
    if (copy != nullptr) {
      RETURN_IF_ERROR(copy->open_file(one.path));
    }
    RETURN_IF_ERROR(read_file(absl::StrCat(backup, "/", one.path), take));
    ++done.files;
    if (hasher.finish() != one.sha256)
      problems.add(one.path, absl::StrCat("does not match its checksum in ", kChecksumFile));
    if (copy == nullptr) continue;
    RETURN_IF_ERROR(problems.status(backup));
    RETURN_IF_ERROR(copy->close_file());
  }
  RETURN_IF_ERROR(problems.status(backup));
  return done;
}

}  // namespace locus::cli
