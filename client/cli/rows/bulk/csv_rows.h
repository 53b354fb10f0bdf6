// Parser of csv records (RFC 4180) into fields and rows. The first record is the header, which names the columns. For
// the row reader. Not thread-safe. Debian's csv libraries for C and C++ are unsuitable: libcsv does not bound the size
// of a field, and fast-cpp-csv-parser does not support line breaks in quotes.
#ifndef LOCUS_CLIENT_CLI_ROWS_BULK_CSV_ROWS_H_
#define LOCUS_CLIENT_CLI_ROWS_BULK_CSV_ROWS_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "client/cli/rows/bulk/row_builder.h"
#include "client/cli/rows/bulk/row_schema.h"

namespace locus::cli {

// Splits `record`, given without its line end, at the commas outside quotes, and removes the quotes. Blanks around an
// unquoted field are dropped. Returns INVALID_ARGUMENT for a quote in the middle of a field; `fields` then contains the
// fields before it. An empty record has one empty field.
absl::Status split_csv_record(absl::string_view record, std::vector<std::string>& fields);

class CsvRows {
 public:
  // Borrows the schema.
  explicit CsvRows(const RowSchema& schema) : schema_(schema) {}

  bool has_header() const { return !slots_.empty(); }
  // Parses the header. Returns INVALID_ARGUMENT for a column that is unknown, repeated, missing, or also given by an
  // option.
  absl::Status read_header(absl::string_view record);
  // Appends one row to `batch`. An empty cell means that the value is not given. Returns INVALID_ARGUMENT for a wrong
  // number of fields or a wrong value.
  absl::Status read_row(absl::string_view record, uint64_t line, RowBuilder& builder, RowBatch& batch);

 private:
  absl::Status check_complete() const;

  const RowSchema& schema_;
  std::vector<Slot> slots_;  // schema field of each csv column; empty before the header
  std::vector<std::string> fields_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_BULK_CSV_ROWS_H_
