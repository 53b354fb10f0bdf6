// A row from one line of JSON. For the row reader; a function without state. Whole numbers are read as such, so that
// ids keep all 64 bits; they may be strings too, as in the answers.
#ifndef LOCUS_CLIENT_CLI_ROWS_BULK_NDJSON_ROWS_H_
#define LOCUS_CLIENT_CLI_ROWS_BULK_NDJSON_ROWS_H_

#include <cstdint>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "client/cli/rows/bulk/row_builder.h"
#include "client/cli/rows/bulk/row_schema.h"

namespace locus::cli {

// Appends the row that the object `text` holds: {"from": [0, 1, 0], "dir.x": 1, "id": "7"}; null is a value that is not
// given. INVALID_ARGUMENT for what is no such object, for unknown or repeated keys and for wrong values; the batch is
// then as it was. Cost: one pass, and no tree is built, so that nesting costs nothing.
absl::Status read_ndjson_row(const RowSchema& schema, absl::string_view text, uint64_t line, RowBuilder& builder,
                             RowBatch& batch);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_BULK_NDJSON_ROWS_H_
