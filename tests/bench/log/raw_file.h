// The minimal log, to compare with: a file to which records are appended, each synced before the next. It has no
// checksums, no sequence numbers and no detection of damage. Only one thread uses a file.
#ifndef LOCUS_TESTS_BENCH_LOG_RAW_FILE_H_
#define LOCUS_TESTS_BENCH_LOG_RAW_FILE_H_

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace locus::bench::log {

class RawFile {
 public:
  // Creates a file. If `reserved` is not 0, first writes at least this number of zero bytes to the file and syncs them.
  // The records overwrite the zeros, so that a sync need not write a new file length. Returns the system's error on
  // failure.
  static absl::StatusOr<std::unique_ptr<RawFile>> create(const std::string& path, uint64_t reserved);
  ~RawFile();
  RawFile(const RawFile&) = delete;
  RawFile& operator=(const RawFile&) = delete;

  // Writes a record and syncs it to the disk (fdatasync). Returns the system's error on failure.
  absl::Status append(absl::string_view record);
  // Returns all appended bytes.
  absl::StatusOr<std::string> read_all() const;

 private:
  explicit RawFile(int file) : file_(file) {}

  const int file_;
  uint64_t written_ = 0;
};

}  // namespace locus::bench::log

#endif  // LOCUS_TESTS_BENCH_LOG_RAW_FILE_H_
