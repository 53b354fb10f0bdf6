// The fields of one csv record (RFC 4180). For the row reader; a function without state. Debian's readers for C and C++
// either hold no bound on a field (libcsv) or know no line break in quotes (fast-cpp-csv-parser), so that this one is
// ours.
#ifndef LOCUS_CLIENT_CLI_ROWS_BULK_CSV_RECORD_H_
#define LOCUS_CLIENT_CLI_ROWS_BULK_CSV_RECORD_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace locus::cli {

// Cuts `record`, which is without its line end, at the commas outside quotes, and takes the quotes away. Blanks around
// a field that is not quoted are dropped. INVALID_ARGUMENT for a quote that does not open or close a field; `fields`
// then hold those before it. An empty record is one empty field.
absl::Status split_csv_record(absl::string_view record, std::vector<std::string>& fields);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_BULK_CSV_RECORD_H_
