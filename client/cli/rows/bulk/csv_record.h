// Splitting of one csv record (RFC 4180) into fields. For the row reader; a function without state. Debian's csv
// libraries for C and C++ are unsuitable: libcsv does not bound the size of a field, and fast-cpp-csv-parser does not
// support line breaks in quotes.
#ifndef LOCUS_CLIENT_CLI_ROWS_BULK_CSV_RECORD_H_
#define LOCUS_CLIENT_CLI_ROWS_BULK_CSV_RECORD_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace locus::cli {

// Splits `record`, given without its line end, at the commas outside quotes, and removes the quotes. Blanks around an
// unquoted field are dropped. Returns INVALID_ARGUMENT for a quote in the middle of a field; `fields` then contains the
// fields before it. An empty record has one empty field.
absl::Status split_csv_record(absl::string_view record, std::vector<std::string>& fields);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_BULK_CSV_RECORD_H_
