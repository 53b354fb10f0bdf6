// A file, a pipe or the standard input, read piece by piece: for inputs that are too long to hold or never end. Not
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
  // "-" is the standard input, which stays open; its name in messages is "stdin". NOT_FOUND for a path that is not
  // there, INVALID_ARGUMENT for one that cannot be read. Opening a named pipe waits for its writer.
  static absl::StatusOr<ByteInput> open(const std::string& path);
  ~ByteInput();
  ByteInput(ByteInput&& other) noexcept;
  ByteInput& operator=(ByteInput&&) = delete;
  ByteInput(const ByteInput&) = delete;
  ByteInput& operator=(const ByteInput&) = delete;

  // Waits for some bytes and reads at most buffer.size() of them; 0 at the end. UNKNOWN if reading fails.
  absl::StatusOr<size_t> read(absl::Span<char> buffer);

  // Whether read() would return at once, or will within `wait`. True at the end too.
  bool ready_within(std::chrono::milliseconds wait) const;

  const std::string& name() const { return name_; }

 private:
  ByteInput(int descriptor, std::string name);

  int descriptor_;
  std::string name_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_BULK_BYTE_INPUT_H_
