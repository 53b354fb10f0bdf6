// A report as it is written while its rows are still coming in: facts known before the rows, rows, facts known after
// them, in any of the formats. For answers too long to hold; write_report() writes whole reports through it. Not
// thread-safe.
//
// Invariant: begin() once, then any number of add(), then end() once.
#ifndef LOCUS_CLIENT_CLI_REPORT_STREAM_H_
#define LOCUS_CLIENT_CLI_REPORT_STREAM_H_

#include <cstddef>
#include <limits>
#include <ostream>
#include <string>
#include <vector>

#include "client/cli/output.h"

namespace locus::cli {

struct ReportShape {
  std::string rows_name;            // the key of the rows in a JSON document
  std::vector<std::string> keys;    // the columns of a table and of csv; empty = those of the first row
  std::string no_rows = "nothing";  // what a table says instead of rows
  // Rows of a table that are held back to find the columns' widths; a longer cell of a later row stands out of line.
  size_t width_rows = std::numeric_limits<size_t>::max();
};

class ReportStream {
 public:
  // Borrows `out`, which must outlive the stream.
  ReportStream(std::ostream& out, Format format, ReportShape shape);

  // Json writes the facts here, a table at the end; csv and ndjson have no place for them.
  void begin(const Json& head);
  void add(const Json& row);
  // Facts that are known only now.
  void end(const Json& tail = Json::object());

 private:
  void add_to_table(const Json& row);
  void write_held();
  void write_cells(const std::vector<std::string>& cells);

  std::ostream& out_;
  const Format format_;
  ReportShape shape_;
  Json head_ = Json::object();
  size_t rows_ = 0;
  std::vector<std::vector<std::string>> held_;  // lines of a table, until width_rows are there
  std::vector<size_t> widths_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_REPORT_STREAM_H_
