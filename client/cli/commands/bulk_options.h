// Options and helpers of the commands that read rows from a file or a pipe. Plain data and functions without state.
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
// Maximum number of batches in flight. Memory is bounded by these and the batch that the reader fills.
inline constexpr size_t kBulkWindow = 4;
// Deadline of one batch without --timeout: longer than for a single call, since it waits for the batches before it.
inline constexpr double kBulkAnswerSeconds = 60;

struct BulkOptions {
  std::optional<std::string> csv;  // paths; "-" = standard input
  std::optional<std::string> ndjson;
  std::optional<uint32_t> batch;
  bool follow = false;  // for queries: each batch is asked at the newest revision

  bool given() const { return csv || ndjson; }
};

// Add --from-csv, --from-ndjson, --batch; for queries also --follow.
void add_bulk_options(CLI::App& command, BulkOptions& options);
void add_bulk_query_options(CLI::App& command, BulkOptions& options);

// Returns a usage error if bulk options exclude each other, or need one that is not given.
absl::Status check(const BulkOptions& options);

// Returns the schema field. If the option has a value, which applies to all rows, the input must not have the field.
template <class T>
Field column_or_option(Field field, const std::vector<T>& values, const std::string& option) {
  if (values.empty()) return field;
  field.required = false;
  field.option = option;
  return field;
}

// Return a usage error for an option with several values, since with bulk input one value applies to all rows.
absl::Status several_values(const std::string& option);
template <class T>
absl::Status at_most_one(const std::vector<T>& values, const std::string& option) {
  return values.size() <= 1 ? absl::OkStatus() : several_values(option);
}

// Opens the input that the options name.
absl::StatusOr<std::unique_ptr<RowReader>> open_rows(const BulkOptions& options, RowSchema schema);

// Range [begin, end) of rows of a batch.
struct RowSpan {
  size_t begin = 0;
  size_t end = 0;
};

// Return the column of these rows to send. A row without a value gets `absent` (one value, or one for each part of a
// vector). If no row of the batch has a value, the result is `otherwise`.
std::vector<float> float_column(const RowColumn& column, RowSpan rows, const std::vector<float>& absent,
                                std::vector<float> otherwise);
std::vector<uint64_t> id_column(const RowColumn& column, RowSpan rows, uint64_t absent,
                                std::vector<uint64_t> otherwise);
std::vector<uint32_t> bits_column(const RowColumn& column, RowSpan rows, uint32_t absent,
                                  std::vector<uint32_t> otherwise);
std::vector<double> positions_of(const RowColumn& column, RowSpan rows);

// Returns `status` with another message; code and payloads stay.
absl::Status in_words(const absl::Status& status, const std::string& message);

// Returns the server's error about a batch with the line of the input prepended: the line of the item that the server
// named, else all lines of the batch.
absl::Status refused_rows(const absl::Status& status, const std::string& input, const SentRows& sent);

// Write and clear the progress line "12345 WHAT" on the error stream, if progress is live.
void show_rows(Context& context, const char* what, uint64_t rows);
void hide_rows(Context& context);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_COMMANDS_BULK_OPTIONS_H_
