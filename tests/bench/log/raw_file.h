// The least that a log can do: a file that records are appended to, each synced before the next. No checksums, no
// numbers, no reader who would notice damage. One thread a file.
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
  // A new file. With `reserved` bytes it holds as many zeros on the disk already, which records overwrite: a sync then
  // has no length to bring to the disk. UNAVAILABLE.
  static absl::StatusOr<std::unique_ptr<RawFile>> create(const std::string& path, uint64_t reserved);
  ~RawFile();
  RawFile(const RawFile&) = delete;
  RawFile& operator=(const RawFile&) = delete;

  // Written and on the disk (fdatasync) when this returns. UNAVAILABLE.
  absl::Status append(absl::string_view record);
  // All that was appended.
  absl::StatusOr<std::string> read_all() const;

 private:
  explicit RawFile(int file) : file_(file) {}

  const int file_;
  uint64_t written_ = 0;
};

}  // namespace locus::bench::log

#endif  // LOCUS_TESTS_BENCH_LOG_RAW_FILE_H_
