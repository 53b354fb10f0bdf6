// Options and helpers shared by the commands that read rows from a file or a pipe. Plain data and functions without
// state.
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
// Maximum number of batches that are sent and not yet answered. This limits the memory used, because the only other
// batch in memory is the one that the reader is filling.
inline constexpr size_t kBulkWindow = 4;
// Deadline of one batch, in seconds, if --timeout is not given. It is longer than the deadline of a single call,
// because a batch waits until the batches before it are answered.
inline constexpr double kBulkAnswerSeconds = 60;

struct BulkOptions {
  std::optional<std::string> csv;  // path of the input; "-" = standard input
  std::optional<std::string> ndjson;
  std::optional<uint32_t> batch;
  bool follow = false;                  // queries only: each batch is answered at the newest revision
  bool one_revision = false;            // updates only: all rows become one revision
  std::optional<double> lease_seconds;  // inserts only: lease of the objects

  bool given() const { return csv || ndjson; }
};

// Add the options --from-csv, --from-ndjson, --batch; the function for updates also adds --one-revision, the function
// for queries --follow.
void add_bulk_update_options(CLI::App& command, BulkOptions& options);
void add_bulk_query_options(CLI::App& command, BulkOptions& options);

// Returns a usage error if bulk options exclude each other, or if another bulk option is given without an
// input.
absl::Status check(const BulkOptions& options);

// Returns `field` for use in a schema. `values` are the values of the command-line option `option`. If `values` is not
// empty, the option determines this field for all rows, so the returned field forbids a column of this name in the
// input.
template <class T>
Field column_or_option(Field field, const std::vector<T>& values, const std::string& option) {
  if (values.empty()) return field;
  field.required = false;
  field.option = option;
  return field;
}

// Returns the usage error for an option that was given several values together with bulk input. With bulk input an
// option may have only one value, which applies to all rows.
absl::Status several_values(const std::string& option);
// Returns several_values(option) if `values` has more than one value, otherwise OK.
template <class T>
absl::Status at_most_one(const std::vector<T>& values, const std::string& option) {
  return values.size() <= 1 ? absl::OkStatus() : several_values(option);
}

// Opens the input that `options` selects, for rows of this schema.
absl::StatusOr<std::unique_ptr<RowReader>> open_rows(const BulkOptions& options, RowSchema schema);

// Range [begin, end) of row indices in a batch.
struct RowSpan {
  size_t begin = 0;
  size_t end = 0;
};

// Return the values of `column` for `rows` in the types of the protocol. A row without a value gets `absent` (one
// value, or one for each part of a vector). If no row of the whole batch has a value, return `otherwise`: usually the
// value of the option of the same name, or an empty vector.
std::vector<float> float_column(const RowColumn& column, RowSpan rows, const std::vector<float>& absent,
                                std::vector<float> otherwise);
std::vector<uint64_t> id_column(const RowColumn& column, RowSpan rows, uint64_t absent,
                                std::vector<uint64_t> otherwise);
std::vector<uint32_t> bits_column(const RowColumn& column, RowSpan rows, uint32_t absent,
                                  std::vector<uint32_t> otherwise);
std::vector<double> positions_of(const RowColumn& column, RowSpan rows);

// Returns `status` with its message replaced by `message`; code and payloads are kept.
absl::Status in_words(const absl::Status& status, const std::string& message);

// Returns `status`, the server's error for the batch `sent`, with "INPUT:LINE: " prepended to its message. LINE is the
// line of the item that the error names. If the error names no item, LINE is the range of all lines of the batch.
absl::Status refused_rows(const absl::Status& status, const std::string& input, const SentRows& sent);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_COMMANDS_BULK_OPTIONS_H_
