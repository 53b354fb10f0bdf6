// Cuts an input into records: lines, or csv records, which may hold line breaks in quotes. For the row readers. Holds
// one piece of the input and at most one record at a time. Not thread-safe.
#ifndef LOCUS_CLIENT_CLI_ROWS_BULK_RECORD_INPUT_H_
#define LOCUS_CLIENT_CLI_ROWS_BULK_RECORD_INPUT_H_

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/cli/rows/bulk/byte_input.h"

namespace locus::cli {

inline constexpr size_t kMaxRecordBytes = 65536;

enum class RecordForm { kLine, kCsv };

struct Record {
  absl::string_view text;  // without its line end and without a byte order mark; valid until the next call
  uint64_t line = 0;       // where it begins, from 1
};

enum class Arrival { kRecord, kPause, kEnd };

class RecordInput {
 public:
  using Clock = std::chrono::steady_clock;

  RecordInput(ByteInput input, RecordForm form) : input_(std::move(input)), form_(form) {}

  // The next record. With `pause_at`, kPause if nothing comes until then and nothing is there any more. Errors are
  // INVALID_ARGUMENT without the input's name (a record over kMaxRecordBytes, a quote that is not closed), or what
  // reading said; line() is where they belong.
  absl::StatusOr<Arrival> next(Record& record, std::optional<Clock::time_point> pause_at);

  const std::string& name() const { return input_.name(); }
  // Of the record that is to come, or that failed.
  uint64_t line() const { return line_; }

 private:
  bool find_end();
  absl::StatusOr<bool> read_more();
  void hand_out(size_t end, Record& record);

  ByteInput input_;
  const RecordForm form_;
  std::string buffer_;
  size_t begin_ = 0;    // of the record to come
  size_t scanned_ = 0;  // what find_end() has seen
  bool in_quotes_ = false;
  bool ended_ = false;
  uint64_t line_ = 1;
  uint64_t next_line_ = 1;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_BULK_RECORD_INPUT_H_
