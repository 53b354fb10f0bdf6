// Input of bytes from a file, a pipe or standard input, read buffer by buffer. For inputs that do not fit in memory or
// never end. Not thread-safe.
#ifndef LOCUS_CLIENT_CLI_ROWS_BULK_BYTE_INPUT_H_
#define LOCUS_CLIENT_CLI_ROWS_BULK_BYTE_INPUT_H_

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "absl/types/span.h"

namespace locus::cli {

class ByteInput {
 public:
  // Opens `path`. "-" is standard input, which the destructor does not close and which is called "stdin" in messages.
  // Returns NOT_FOUND if the path does not exist, INVALID_ARGUMENT if it cannot be read. Opening a named pipe blocks
  // until a writer opens it.
  static absl::StatusOr<ByteInput> open(const std::string& path);
  ~ByteInput();
  ByteInput(ByteInput&& other) noexcept;
  ByteInput& operator=(ByteInput&&) = delete;
  ByteInput(const ByteInput&) = delete;
  ByteInput& operator=(const ByteInput&) = delete;

  // Waits for data, reads at most buffer.size() bytes and returns the number of bytes read, 0 at the end of the input.
  // Returns UNKNOWN if reading fails.
  absl::StatusOr<size_t> read(absl::Span<char> buffer);

  // Waits at most `wait` for data. Returns whether read() would return without waiting. The result is true at the end
  // of the input and after an error, too.
  bool ready_within(std::chrono::milliseconds wait) const;

  const std::string& name() const { return name_; }
  // Returns the part of a regular file that read() has returned, from 0 to 1; negative if the size of the input is
  // unknown, as that of a pipe.
  double share_read() const {
    return size_ == 0 ? -1 : std::min(1.0, static_cast<double>(read_) / static_cast<double>(size_));
  }

 private:
  ByteInput(int descriptor, std::string name);

  int descriptor_;
  std::string name_;
  uint64_t size_ = 0;  // 0 = unknown
  uint64_t read_ = 0;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_BULK_BYTE_INPUT_H_
