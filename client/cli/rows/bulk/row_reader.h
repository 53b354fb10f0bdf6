// Reader of csv or ndjson rows, batch by batch. For the commands that accept rows; these commands use no other reader
// of this folder. Not thread-safe. Holds at most one batch and one read buffer in memory.
#ifndef LOCUS_CLIENT_CLI_ROWS_BULK_ROW_READER_H_
#define LOCUS_CLIENT_CLI_ROWS_BULK_ROW_READER_H_

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/rows/bulk/csv_rows.h"
#include "client/cli/rows/bulk/record_input.h"
#include "client/cli/rows/bulk/row_builder.h"
#include "client/cli/rows/bulk/row_schema.h"

namespace locus::cli {

enum class RowFormat { kCsv, kNdjson };

// Time, counted from the first row of a batch, for which the reader waits for more rows. After this time the batch ends
// as soon as the input has no data ready, so that rows of a slow input are not held back.
inline constexpr std::chrono::milliseconds kRowPause{50};

enum class BatchEnd {
  kFull,   // the batch has max_rows rows
  kPause,  // the input has no data ready
  kEnd,    // the input has ended
};

// Behaviour of next() while the batch is still empty. kWait: waits for the first row. kPause: returns BatchEnd::kPause
// after kRowPause.
enum class Patience { kWait, kPause };

class RowReader {
 public:
  RowReader(ByteInput input, RowFormat format, RowSchema schema);
  RowReader(const RowReader&) = delete;
  RowReader& operator=(const RowReader&) = delete;

  // Reads the next rows, at most `max_rows`, into `batch`. The batch can be empty at the end of the input, and with
  // Patience::kPause. Returns INVALID_ARGUMENT with the message "FILE:LINE: REASON" for a malformed row, or UNKNOWN if
  // reading fails; after an error neither the batch nor the reader may be used.
  absl::StatusOr<BatchEnd> next(size_t max_rows, Patience patience, RowBatch& batch);

  const RowSchema& schema() const { return schema_; }
  const std::string& name() const { return input_.name(); }
  // Returns the part of the input that was read, as ByteInput::share_read().
  double share_read() const { return input_.share_read(); }

 private:
  absl::StatusOr<BatchEnd> fill(size_t max_rows, Patience patience, RowBatch& batch);
  absl::Status take(const Record& record, RowBatch& batch);

  const RowSchema schema_;
  const RowFormat format_;
  RecordInput input_;
  RowBuilder builder_;
  CsvRows csv_;
  uint64_t rows_ = 0;  // number of rows in all batches so far
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_BULK_ROW_READER_H_
