// Parser of one line of JSON into a row. For the row reader; a function without state. Integers are not converted to
// double, so that ids keep all 64 bits; ids may also be strings, as in the reports of locus.
#ifndef LOCUS_CLIENT_CLI_ROWS_BULK_NDJSON_ROWS_H_
#define LOCUS_CLIENT_CLI_ROWS_BULK_NDJSON_ROWS_H_

#include <cstdint>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "client/cli/rows/bulk/row_builder.h"
#include "client/cli/rows/bulk/row_schema.h"

namespace locus::cli {

// Parses `text`, one object such as {"from": [0, 1, 0], "dir.x": 1, "id": "7"}, and appends its row to `batch`. Null
// means that the value is not given. Returns INVALID_ARGUMENT for any other text, for unknown or repeated keys and for
// wrong values, and then leaves the batch unchanged. Cost: linear; no tree is built, so deep nesting takes no memory.
absl::Status read_ndjson_row(const RowSchema& schema, absl::string_view text, uint64_t line, RowBuilder& builder,
                             RowBatch& batch);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_BULK_NDJSON_ROWS_H_
