// Input split into records: lines, or csv records, which may contain quoted line breaks. For the row readers. Holds one
// read buffer and at most one record in memory. Not thread-safe.
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
  absl::string_view text;  // without line end and byte order mark; valid until the next call of RecordInput::next()
  uint64_t line = 0;       // line of the input where the record begins, from 1
};

enum class Arrival { kRecord, kPause, kEnd };

class RecordInput {
 public:
  using Clock = std::chrono::steady_clock;

  RecordInput(ByteInput input, RecordForm form) : input_(std::move(input)), form_(form) {}

  // Reads the next record. With `pause_at`, returns kPause if no data is available by that time. Returns
  // INVALID_ARGUMENT for a record of more than kMaxRecordBytes or an unclosed quote, or the error of ByteInput::read().
  // The message of INVALID_ARGUMENT contains neither the input nor the line, so the caller must add name() and line().
  absl::StatusOr<Arrival> next(Record& record, std::optional<Clock::time_point> pause_at);

  const std::string& name() const { return input_.name(); }
  double share_read() const { return input_.share_read(); }
  // Returns the line where the record of the last call of next() begins, from 1, even if that call failed.
  uint64_t line() const { return line_; }

 private:
  bool find_end();
  absl::StatusOr<bool> read_more();
  void hand_out(size_t end, Record& record);

  ByteInput input_;
  const RecordForm form_;
  std::string buffer_;
  size_t begin_ = 0;    // start of the next record in buffer_
  size_t scanned_ = 0;  // end of the bytes that find_end() has scanned
  bool in_quotes_ = false;
  bool ended_ = false;
  uint64_t line_ = 1;
  uint64_t next_line_ = 1;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_BULK_RECORD_INPUT_H_
