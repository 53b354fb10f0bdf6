// File to which whole lines are appended. If a line would make the file larger than its maximum size, the file is
// renamed first and a new file is begun: FILE becomes FILE.1, FILE.1 becomes FILE.2 and so on. One thread at a time.
#ifndef LOCUS_SERVER_SECURITY_ROTATED_FILE_H_
#define LOCUS_SERVER_SECURITY_ROTATED_FILE_H_

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace locus::server {

class RotatedFile {
 public:
  // Opens or creates the file with mode 0600. Keeps at most `files` files, the current one included.
  static absl::StatusOr<std::unique_ptr<RotatedFile>> open(const std::string& file, uint64_t max_bytes, uint32_t files);
  ~RotatedFile();
  RotatedFile(const RotatedFile&) = delete;
  RotatedFile& operator=(const RotatedFile&) = delete;

  // Appends a line, whole or not at all. Renames the files first if the line would exceed the maximum size.
  absl::Status append(absl::string_view line);
  // Opens the file by its name again. If that fails, the old file stays in use.
  absl::Status reopen();

 private:
  RotatedFile(std::string file, uint64_t max_bytes, uint32_t files)
      : file_(std::move(file)), max_bytes_(max_bytes), files_(files) {}
  void rename_all() const;

  const std::string file_;
  const uint64_t max_bytes_;
  const uint32_t files_;
  int descriptor_ = -1;
  uint64_t size_ = 0;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_ROTATED_FILE_H_
