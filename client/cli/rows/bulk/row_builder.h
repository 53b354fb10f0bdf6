// Builder that appends rows to a batch, value by value, and validates every value of the untrusted input. For the csv
// and ndjson readers. Not thread-safe.
//
// Invariant: the batch contains only complete, valid rows; a row with an error leaves the batch unchanged.
#ifndef LOCUS_CLIENT_CLI_ROWS_BULK_ROW_BUILDER_H_
#define LOCUS_CLIENT_CLI_ROWS_BULK_ROW_BUILDER_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "client/cli/rows/bulk/row_schema.h"

namespace locus::cli {

class RowBuilder {
 public:
  // Borrows the schema. Precondition: every vector field of the schema has at most 32 parts.
  explicit RowBuilder(const RowSchema& schema);

  // Returns an empty batch with the schema's columns.
  RowBatch empty_batch(uint64_t first_row) const;

  // Begins a new row, without values.
  void start();
  // Sets one value of the current row, from text or from a JSON number. If the field is a vector, `slot` must select
  // one of its parts. Errors are INVALID_ARGUMENT and name the column and the value: "dir.y: 'abc' is no number".
  absl::Status put_text(const Slot& slot, absl::string_view text);
  absl::Status put_number(const Slot& slot, double value);
  absl::Status put_integer(const Slot& slot, uint64_t value);
  // Appends the current row to `batch`. Returns INVALID_ARGUMENT if a required field or a part of a vector is missing.
  // `line` is the row's line in the input.
  absl::Status finish(uint64_t line, RowBatch& batch);

 private:
  struct Value {
    std::vector<double> numbers;  // one for each part
    uint64_t integer = 0;
    std::string text = {};
    uint32_t parts_given = 0;  // bit i: part i has a value
  };

  absl::Status wrong(const Slot& slot, absl::string_view what) const;
  absl::Status store(const Slot& slot, double number, uint64_t integer);

  const RowSchema& schema_;
  std::vector<Value> values_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_BULK_ROW_BUILDER_H_
