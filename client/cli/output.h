// Reports: the only form in which commands write answers. A report has a head (facts about the whole answer) and rows.
// A report is printed as an aligned table, as one JSON document, as one JSON object per line, or as csv. Plain data and
// functions without state. Rows that arrive one after another are written through client/cli/report_stream.h.
//
// In JSON, ids, groups, tags and epochs are strings, since many JSON readers round 64-bit integers; revisions, ticks
// and counts are numbers; a miss and infinity are null.
#ifndef LOCUS_CLIENT_CLI_OUTPUT_H_
#define LOCUS_CLIENT_CLI_OUTPUT_H_

#include <cstdint>
#include <ostream>
#include <string>
#include <vector>

#include "absl/types/span.h"
#include "nlohmann/json.hpp"

namespace locus::cli {

// JSON value whose objects preserve the order in which keys were added.
using Json = nlohmann::ordered_json;

enum class Format { kTable, kJson, kNdjson, kCsv };

struct Report {
  Json head = Json::object();
  std::string rows_name;  // key of the rows in a JSON document; empty = a report without rows
  std::vector<Json> rows;
  std::string no_rows = "nothing";  // text printed instead of a table that has no rows
  // Columns of a table and of csv. If empty, a table uses the keys of the first row, and csv uses the keys of all rows.
  // Set `keys` if the report may have no rows, so that csv output has a header even then.
  std::vector<std::string> keys = {};
};

// Writes a report in `format`.
//   table:  a header, one line per row, then the head on one line; without rows_name, one line per entry of the head
//   json:   {head..., rows_name: [rows]}
//   ndjson: one line per row, without the head; without rows_name, the head on one line
//   csv:    a header and one line per row, without the head; without rows_name, a header and one line with the head
void write_report(std::ostream& out, Format format, const Report& report);

// Returns `value` as JSON on one line. Bytes that are not UTF-8 are replaced, since a text from a server may contain
// any bytes.
std::string json_line(const Json& value);
// Returns the text of a table cell: "yes" or "no" for a boolean, "-" for null, and a list's entries separated by
// commas.
std::string table_cell(const Json& value);

// Returns an id, group, tag or epoch as a string.
Json id_json(uint64_t id);
// Returns the shortest decimal that parses to the same float; null if `value` is not finite.
Json float_json(float value);
Json floats_json(absl::Span<const float> values);
Json doubles_json(absl::Span<const double> values);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_OUTPUT_H_
