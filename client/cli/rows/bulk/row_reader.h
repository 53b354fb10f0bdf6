// Reads a csv or ndjson input batch by batch. For the commands that take rows; the only door to this room's readers.
// Not thread-safe. Holds no more than one batch and one piece of the input.
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

// How long rows that are there wait for more to share a batch with, once the input has nothing ready.
inline constexpr std::chrono::milliseconds kRowPause{50};

enum class BatchEnd {
  kFull,   // as many rows as asked for
  kPause,  // the input has nothing more to give now
  kEnd,    // the input is over
};

// What a reader does while it has no row yet.
enum class Patience { kWait, kPause };

class RowReader {
 public:
  RowReader(ByteInput input, RowFormat format, RowSchema schema);
  RowReader(const RowReader&) = delete;
  RowReader& operator=(const RowReader&) = delete;

  // Reads the next rows, at most `max_rows`, into `batch`. With Patience::kPause a batch may end without a row, as it
  // may at the end. Errors are "FILE:LINE: what is wrong"; the batch is then of no use, and the reader is spent.
  absl::StatusOr<BatchEnd> next(size_t max_rows, Patience patience, RowBatch& batch);

  const RowSchema& schema() const { return schema_; }
  const std::string& name() const { return input_.name(); }

 private:
  absl::StatusOr<BatchEnd> fill(size_t max_rows, Patience patience, RowBatch& batch);
  absl::Status take(const Record& record, RowBatch& batch);

  const RowSchema schema_;
  const RowFormat format_;
  RecordInput input_;
  RowBuilder builder_;
  CsvRows csv_;
  uint64_t rows_ = 0;  // of all batches
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_BULK_ROW_READER_H_
