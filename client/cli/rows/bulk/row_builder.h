// Puts one row after another into a batch, value by value, and checks each: the door through which untrusted numbers
// come in. For the csv and ndjson readers. Not thread-safe.
//
// Invariant: a row reaches the batch whole and checked, or not at all.
#ifndef LOCUS_CLIENT_CLI_ROWS_BULK_ROW_BUILDER_H_
#define LOCUS_CLIENT_CLI_ROWS_BULK_ROW_BUILDER_H_

#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "client/cli/rows/bulk/row_schema.h"

namespace locus::cli {

class RowBuilder {
 public:
  // Borrows the schema.
  explicit RowBuilder(const RowSchema& schema);

  // An empty batch with the schema's columns.
  RowBatch empty_batch(uint64_t first_row) const;

  void start();
  // One value, as text or as JSON has it. `slot` names a part where the field has parts. Errors are INVALID_ARGUMENT
  // and say the column and what was found: "dir.y: 'abc' is no number".
  absl::Status put_text(const Slot& slot, absl::string_view text);
  absl::Status put_number(const Slot& slot, double value);
  absl::Status put_integer(const Slot& slot, uint64_t value);
  // Appends the row; refused if a required field or a part of a vector is missing.
  absl::Status finish(uint64_t line, RowBatch& batch);

 private:
  struct Value {
    std::array<double, 4> numbers{};
    uint64_t integer = 0;
    uint32_t parts_given = 0;  // a bit each
  };

  absl::Status wrong(const Slot& slot, absl::string_view what) const;
  absl::Status store(const Slot& slot, double number, uint64_t integer);

  const RowSchema& schema_;
  std::vector<Value> values_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_BULK_ROW_BUILDER_H_
