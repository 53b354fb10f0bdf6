#include "client/cli/rows/bulk/row_reader.h"

#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/cli/rows/bulk/ndjson_rows.h"
#include "core/base/status_macros.h"

namespace locus::cli {

RowReader::RowReader(ByteInput input, RowFormat format, RowSchema schema)
    : schema_(std::move(schema)),
      format_(format),
      input_(std::move(input), format == RowFormat::kCsv ? RecordForm::kCsv : RecordForm::kLine),
      builder_(schema_),
      csv_(schema_) {}

absl::StatusOr<BatchEnd> RowReader::next(size_t max_rows, Patience patience, RowBatch& batch) {
  batch = builder_.empty_batch(rows_);
  absl::StatusOr<BatchEnd> end = fill(max_rows, patience, batch);
  rows_ += batch.rows();
  if (end.ok() || absl::IsUnknown(end.status())) return end;
  return absl::InvalidArgumentError(absl::StrCat(name(), ":", input_.line(), ": ", end.status().message()));
}

absl::StatusOr<BatchEnd> RowReader::fill(size_t max_rows, Patience patience, RowBatch& batch) {
  using Clock = RecordInput::Clock;
  std::optional<Clock::time_point> pause_at;
  if (patience == Patience::kPause) pause_at = Clock::now() + kRowPause;
  while (batch.rows() < max_rows) {
    Record record;
    ASSIGN_OR_RETURN(const Arrival arrival, input_.next(record, pause_at));
    if (arrival == Arrival::kPause) return BatchEnd::kPause;
    if (arrival == Arrival::kEnd) {
      if (format_ == RowFormat::kNdjson || csv_.has_header()) return BatchEnd::kEnd;
      return absl::InvalidArgumentError(
          absl::StrCat("is empty; the first line names the columns, out of: ", known_columns(schema_)));
    }
    if (absl::StripAsciiWhitespace(record.text).empty()) continue;
    RETURN_IF_ERROR(take(record, batch));
    if (batch.rows() == 1) pause_at = Clock::now() + kRowPause;
  }
  return BatchEnd::kFull;
}

absl::Status RowReader::take(const Record& record, RowBatch& batch) {
  if (format_ == RowFormat::kNdjson) return read_ndjson_row(schema_, record.text, record.line, builder_, batch);
  if (!csv_.has_header()) return csv_.read_header(record.text);
  return csv_.read_row(record.text, record.line, builder_, batch);
}

}  // namespace locus::cli
