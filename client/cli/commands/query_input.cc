#include "client/cli/commands/query_input.h"

#include <algorithm>
#include <fstream>
#include <set>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/cli/choices.h"
#include "client/cli/commands.h"
#include "client/cli/failure.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

// Rows in one batch. A query by list may take milliseconds.
constexpr const char* kRowsInBatch = "64";

// Returns the kind of query whose rows have the columns of `line`, the first line of an input; empty if no kind does.
// Columns that several kinds have mean the first of them: sweep before capsule, nearest before cell and contains.
std::string kind_of_columns(const std::string& line) {
  std::set<std::string> words;
  std::string word;
  for (const char c : line + " ") {
    if (absl::ascii_isalpha(static_cast<unsigned char>(c)) || c == '_') {
      word += c;
    } else if (!word.empty()) {
      words.insert(std::exchange(word, ""));
    }
  }
  constexpr std::pair<const char*, const char*> kKinds[] = {
      {"view", "frustum"},     {"viewer", "sight"}, {"dir", "ray"},    {"way", "sweep"},       {"half", "box"},
      {"half_extents", "box"}, {"radius", "ball"},  {"at", "nearest"}, {"position", "nearest"}};
  for (const auto& [column, kind] : kKinds)
    if (words.count(column) != 0) return kind;
  return "";
}

absl::StatusOr<std::string> kind_of_input(const QueryInput& input) {
  if (!input.kind.empty()) return input.kind;
  if (input.path == "-") return usage_error("rows from standard input need --kind");
  std::ifstream file(input.path);
  std::string line;
  while (line.empty() && std::getline(file, line)) {
  }
  if (!file && line.empty()) return absl::NotFoundError(absl::StrCat(input.path, ": no rows can be read"));
  std::string kind = kind_of_columns(line);
  if (kind.empty()) return usage_error(absl::StrCat(input.path, ": no kind of query has these columns; give --kind"));
  return kind;
}

}  // namespace

void add_input_kind_option(CLI::App& command, std::string& kind) {
  const std::vector<std::string> kinds = {"ray",     "ball",     "box",   "capsule", "sweep",
                                          "frustum", "contains", "sight", "nearest", "cell"};
  command.add_option("--kind", kind, "Kind of the rows, as in `locus query KIND` [known by the columns]")
      ->type_name("KIND")
      ->check(choices(kinds));
}

// Runs the line `locus query KIND SCENE` on the input, whose batches are passed to the sink instead of sent.
absl::Status for_each_query_batch(const QueryInput& input, const std::string& scene, Context& context,
                                  const BatchSink& sink) {
  ASSIGN_OR_RETURN(const std::string kind, kind_of_input(input));
  const bool is_csv = absl::EndsWithIgnoreCase(input.path, ".csv");
  std::vector<std::string> words = {"query",    kind,      scene,       is_csv ? "--from-csv" : "--from-ndjson",
                                    input.path, "--batch", kRowsInBatch};
  std::reverse(words.begin(), words.end());
  CLI::App app;
  add_query_command(app, context);
  bool has_rows = false;
  context.set_batch_sink([&](v1::QueryBatch batch, const std::string& lines) {
    has_rows = true;
    return sink(std::move(batch), lines);
  });
  try {
    app.parse(std::move(words));
  } catch (const CLI::ParseError& error) {
    context.finish(usage_error(error.what()));
  }
  context.set_batch_sink(nullptr);
  RETURN_IF_ERROR(context.outcome());
  if (!has_rows) return absl::InvalidArgumentError(absl::StrCat(input.path, ": there are no rows"));
  return absl::OkStatus();
}

}  // namespace locus::cli
