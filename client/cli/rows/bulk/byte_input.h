// A file, a pipe or standard input, read in chunks: for inputs that are too large for memory or never end. Not
// thread-safe.
#ifndef LOCUS_CLIENT_CLI_ROWS_BULK_BYTE_INPUT_H_
#define LOCUS_CLIENT_CLI_ROWS_BULK_BYTE_INPUT_H_

#include <chrono>
#include <cstddef>
#include <string>

#include "absl/status/statusor.h"
#include "absl/types/span.h"

namespace locus::cli {

class ByteInput {
 public:
  // Opens `path`. "-" is standard input, which stays open and is called "stdin" in messages. NOT_FOUND if the path does
  // not exist, INVALID_ARGUMENT if it cannot be read. Opening a named pipe waits for its writer.
  static absl::StatusOr<ByteInput> open(const std::string& path);
  ~ByteInput();
  ByteInput(ByteInput&& other) noexcept;
  ByteInput& operator=(ByteInput&&) = delete;
  ByteInput(const ByteInput&) = delete;
  ByteInput& operator=(const ByteInput&) = delete;

  // Waits for data, reads at most buffer.size() bytes and returns their count, 0 at the end. UNKNOWN if reading fails.
  absl::StatusOr<size_t> read(absl::Span<char> buffer);

  // Returns whether read() has data within `wait`. True at the end and after an error, too.
  bool ready_within(std::chrono::milliseconds wait) const;

  const std::string& name() const { return name_; }

 private:
  ByteInput(int descriptor, std::string name);

  int descriptor_;
  std::string name_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_BULK_BYTE_INPUT_H_
