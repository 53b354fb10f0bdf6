// The options of commands that take rows from a file or a pipe, and what such commands share. Plain data and functions
// without state.
#ifndef LOCUS_CLIENT_CLI_COMMANDS_BULK_OPTIONS_H_
#define LOCUS_CLIENT_CLI_COMMANDS_BULK_OPTIONS_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "CLI/CLI.hpp"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/context.h"
#include "client/cli/rows/bulk/row_reader.h"
#include "client/cli/rows/bulk/sent_rows.h"

namespace locus::cli {

inline constexpr uint32_t kDefaultBulkBatch = 8192;
inline constexpr uint32_t kMaxBulkBatch = 65536;
// Batches under way at once. With the reader's one it bounds what is held, however long the input is.
inline constexpr size_t kBulkWindow = 4;
// How long one batch may take without --timeout: many times a single call's, since others of the window go before it.
inline constexpr double kBulkAnswerSeconds = 60;

struct BulkOptions {
  std::optional<std::string> csv;  // paths; "-" = standard input
  std::optional<std::string> ndjson;
  std::optional<uint32_t> batch;
  bool follow = false;  // queries: later batches may see newer revisions

  bool given() const { return csv || ndjson; }
};

// --from-csv, --from-ndjson, --batch; for queries also --follow.
void add_bulk_options(CLI::App& command, BulkOptions& options);
void add_bulk_query_options(CLI::App& command, BulkOptions& options);

// Usage error for bulk options that do not go together, or alone.
absl::Status check(const BulkOptions& options);

// The field, or the option that gives it for all rows: then the input must not have it.
template <class T>
Field column_or_option(Field field, const std::vector<T>& values, const std::string& option) {
  if (values.empty()) return field;
  field.required = false;
  field.option = option;
  return field;
}

// Usage error for an option with several values: with bulk input it is one for all rows.
absl::Status several_values(const std::string& option);
template <class T>
absl::Status at_most_one(const std::vector<T>& values, const std::string& option) {
  return values.size() <= 1 ? absl::OkStatus() : several_values(option);
}

// A reader of the input that the options name.
absl::StatusOr<std::unique_ptr<RowReader>> open_rows(const BulkOptions& options, RowSchema schema);

// Rows [begin, end) of a batch.
struct RowSpan {
  size_t begin = 0;
  size_t end = 0;
};

// One column of those rows as it is sent: `absent` (one value, or as many as the vector has parts) for a row that does
// not give it, and `otherwise` instead of a column that no row of the batch gives.
std::vector<float> float_column(const RowColumn& column, RowSpan rows, const std::vector<float>& absent,
                                std::vector<float> otherwise);
std::vector<uint64_t> id_column(const RowColumn& column, RowSpan rows, uint64_t absent,
                                std::vector<uint64_t> otherwise);
std::vector<uint32_t> bits_column(const RowColumn& column, RowSpan rows, uint32_t absent,
                                  std::vector<uint32_t> otherwise);
std::vector<double> positions_of(const RowColumn& column, RowSpan rows);

// The same status in other words: code and details stay.
absl::Status in_words(const absl::Status& status, const std::string& message);

// What a server said about a batch, with the input's line where the server named an item, else with the lines of the
// batch.
absl::Status refused_rows(const absl::Status& status, const std::string& input, const SentRows& sent);

// "\r12,345 rows" on a live error stream; nothing else.
void show_rows(Context& context, const char* what, uint64_t rows);
void hide_rows(Context& context);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_COMMANDS_BULK_OPTIONS_H_
