// The minimum that a log must do: a file to which records are appended, each synced before the next. No checksums, no
// sequence numbers, no detection of damage. One thread a file.
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
  // Creates a file. With `reserved` bytes it already holds that many zeros on the disk, which records overwrite: then a
  // sync has no new file length to write. UNAVAILABLE.
  static absl::StatusOr<std::unique_ptr<RawFile>> create(const std::string& path, uint64_t reserved);
  ~RawFile();
  RawFile(const RawFile&) = delete;
  RawFile& operator=(const RawFile&) = delete;

  // Writes a record; it is on the disk (fdatasync) at return. UNAVAILABLE.
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
