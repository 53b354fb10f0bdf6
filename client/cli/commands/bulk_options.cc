#include "client/cli/commands/bulk_options.h"

#include <algorithm>

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "client/cli/failure.h"
#include "client/lib/status.h"
#include "core/base/limits.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

void add_bulk_options(CLI::App& command, BulkOptions& options) {
  command.add_option("--from-csv", options.csv, "Rows from a csv file with a header line; - is standard input")
      ->type_name("FILE");
  command
      .add_option("--from-ndjson", options.ndjson, "Rows from a file with a JSON object a line; - is standard input")
      ->type_name("FILE");
  command
      .add_option(
          "--batch", options.batch,
          absl::StrCat("Maximum number of rows in one batch, up to ", kMaxBulkBatch, " [", kDefaultBulkBatch, "]"))
      ->type_name("ROWS")
      ->check(CLI::Range(uint32_t{1}, kMaxBulkBatch).description(""));
}

}  // namespace

void add_bulk_update_options(CLI::App& command, BulkOptions& options) {
  add_bulk_options(command, options);
  command.add_flag(
      "--one-revision", options.one_revision,
      absl::StrCat("With an input of up to ", limits::kMaxUpdateItems, " rows: apply all rows as one revision"));
}

void add_bulk_query_options(CLI::App& command, BulkOptions& options) {
  add_bulk_options(command, options);
  command.add_flag("--follow", options.follow,
                   "With an input: query each batch at the newest revision [all at the revision of the first answer]");
}

absl::Status check(const BulkOptions& options) {
  if (options.csv && options.ndjson) return usage_error("give --from-csv or --from-ndjson, not both");
  if (options.batch && !options.given()) return usage_error("--batch needs --from-csv or --from-ndjson");
  if (options.one_revision && !options.given()) return usage_error("--one-revision needs --from-csv or --from-ndjson");
  if (options.lease_seconds && !options.given()) return usage_error("--lease needs --from-csv or --from-ndjson");
  if (options.follow && !options.given()) return usage_error("--follow needs --from-csv or --from-ndjson");
  return absl::OkStatus();
}

absl::Status several_values(const std::string& option) {
  return usage_error(absl::StrCat("with an input, give ", option, " once, for all rows, or make it a column"));
}

absl::StatusOr<std::unique_ptr<RowReader>> open_rows(const BulkOptions& options, RowSchema schema) {
  ASSIGN_OR_RETURN(ByteInput input, ByteInput::open(options.csv ? *options.csv : *options.ndjson));
  const RowFormat format = options.csv ? RowFormat::kCsv : RowFormat::kNdjson;
  return std::make_unique<RowReader>(std::move(input), format, std::move(schema));
}

std::vector<float> float_column(const RowColumn& column, RowSpan rows, const std::vector<float>& absent,
                                std::vector<float> otherwise) {
  if (!column.any()) return otherwise;
  const size_t parts = absent.size();
  std::vector<float> values;
  values.reserve((rows.end - rows.begin) * parts);
  for (size_t row = rows.begin; row < rows.end; ++row) {
    for (size_t part = 0; part < parts; ++part) {
      const double number = column.numbers[row * parts + part];
      values.push_back(column.given[row] != 0 ? static_cast<float>(number) : absent[part]);
    }
  }
  return values;
}

std::vector<uint64_t> id_column(const RowColumn& column, RowSpan rows, uint64_t absent,
                                std::vector<uint64_t> otherwise) {
  if (!column.any()) return otherwise;
  std::vector<uint64_t> values;
  values.reserve(rows.end - rows.begin);
  for (size_t row = rows.begin; row < rows.end; ++row) {
    values.push_back(column.given[row] != 0 ? column.integers[row] : absent);
  }
  return values;
}

std::vector<uint32_t> bits_column(const RowColumn& column, RowSpan rows, uint32_t absent,
                                  std::vector<uint32_t> otherwise) {
  if (!column.any()) return otherwise;
  const std::vector<uint64_t> wide = id_column(column, rows, absent, {});
  std::vector<uint32_t> values;
  values.reserve(wide.size());
  for (const uint64_t value : wide) values.push_back(static_cast<uint32_t>(value));
  return values;
}

std::vector<double> positions_of(const RowColumn& column, RowSpan rows) {
  const auto begin = column.numbers.begin();
  return std::vector<double>(begin + static_cast<std::ptrdiff_t>(3 * rows.begin),
                             begin + static_cast<std::ptrdiff_t>(3 * rows.end));
}

absl::Status in_words(const absl::Status& status, const std::string& message) {
  absl::Status result(status.code(), message);
  status.ForEachPayload([&](auto type, const absl::Cord& payload) { result.SetPayload(type, payload); });
  return result;
}

absl::Status refused_rows(const absl::Status& status, const std::string& input, const SentRows& sent) {
  std::string lines = sent.line_range();
  const std::optional<v1::Error> error = client::error_of(status);
  if (error && error->has_index()) {
    const std::optional<uint64_t> line = sent.line_of(error->field(), error->index());
    if (line) lines = absl::StrCat(*line);
  }
  const std::string where = lines.empty() ? input : absl::StrCat(input, ":", lines);
  return in_words(status, absl::StrCat(where, ": ", status.message()));
}

}  // namespace locus::cli
