// Writer of a report, in any output format, whose rows arrive one after another. A report consists of facts known
// before the rows, the rows, and facts known only after the last row. For answers too large to hold in memory;
// write_report() uses ReportStream, too. Not thread-safe.
//
// Call order: begin() once, then add() for each row, then end() once.
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
  std::string rows_name;            // key of the rows in a JSON document
  std::vector<std::string> keys;    // columns of a table and of csv; empty = the keys of the first row
  std::string no_rows = "nothing";  // text of a table without rows
  // Number of rows that a table buffers to compute the widths of its columns. A longer cell in a later row breaks the
  // alignment.
  size_t width_rows = std::numeric_limits<size_t>::max();
};

class ReportStream {
 public:
  // Borrows `out`, which must outlive the stream.
  ReportStream(std::ostream& out, Format format, ReportShape shape);

  // Begins the report. `head` contains facts known before the rows: json writes them before the rows, a table writes
  // them below its rows, csv and ndjson omit them.
  void begin(const Json& head);
  void add(const Json& row);
  // Ends the report. `tail` contains facts known only after the last row; they are written like the facts in `head`.
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
  std::vector<std::vector<std::string>> held_;  // table: buffered header and first width_rows rows
  std::vector<size_t> widths_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_REPORT_STREAM_H_
