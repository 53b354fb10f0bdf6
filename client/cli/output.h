// The one place where the command line writes answers: a report is a head (facts about the whole answer) and rows, and
// prints as an aligned table for people, as one JSON document, as one JSON object a line, or as csv. Plain data and
// functions without state. Rows that come in one after another go through client/cli/report_stream.h.
//
// In JSON, ids, groups, tags and epochs are strings, since they use all 64 bits; revisions, ticks and counts are
// numbers; what is not there (a miss, infinity) is null.
#ifndef LOCUS_CLIENT_CLI_OUTPUT_H_
#define LOCUS_CLIENT_CLI_OUTPUT_H_

#include <cstdint>
#include <ostream>
#include <string>
#include <vector>

#include "absl/types/span.h"
#include "nlohmann/json.hpp"

namespace locus::cli {

// Keeps keys in the order of writing.
using Json = nlohmann::ordered_json;

enum class Format { kTable, kJson, kNdjson, kCsv };

struct Report {
  Json head = Json::object();
  std::string rows_name;  // the key of the rows in a JSON document; empty = the head is all there is
  std::vector<Json> rows;
  std::string no_rows = "nothing";  // what a table says instead of rows
  // The columns of a table and of csv. Empty = those of the first row, in csv those of all rows; name them where there
  // may be no row, so that csv has its header all the same.
  std::vector<std::string> keys = {};
};

// Table: a line a row under a header of the keys of the first row, then the head on one line; without rows_name, a line
// an entry of the head. JSON: {head..., rows_name: [rows]}. NDJSON: a line a row; without rows_name the head. CSV: a
// header and a line a row, without the head; without rows_name a header and one line of the head.
void write_report(std::ostream& out, Format format, const Report& report);

// One line of JSON. What is not UTF-8 is replaced: a server's text may hold anything.
std::string json_line(const Json& value);
// A value as people read it: yes and no, "-" for null, lists with commas.
std::string table_cell(const Json& value);

// 64-bit names as strings.
Json id_json(uint64_t id);
// The shortest decimal that reads back as the same float; null where it is not finite.
Json float_json(float value);
Json floats_json(absl::Span<const float> values);
Json doubles_json(absl::Span<const double> values);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_OUTPUT_H_
