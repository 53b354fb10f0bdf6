// Rows as csv (RFC 4180, with a line feed at the end of a line): for the report stream. Functions without state.
//
// The keys of a row decide its columns: a key that names a vector is split (`normal.x,normal.y,normal.z`, `uv.u,uv.v`,
// `rotation.x` .. `rotation.w`), any other key is one column. Values do not matter, so that the header is the same for
// every result. Other lists and objects are one cell of JSON.
#ifndef LOCUS_CLIENT_CLI_CSV_TEXT_H_
#define LOCUS_CLIENT_CLI_CSV_TEXT_H_

#include <string>
#include <vector>

#include "client/cli/output.h"

namespace locus::cli {

// Returns the header line, without a line feed.
std::string csv_header(const std::vector<std::string>& keys);

// Returns the line of one row, without a line feed. Null and absent values are empty cells. A text is quoted if it has
// a comma, a quote, a line break or a blank at either end, or if it is empty, which distinguishes it from null.
std::string csv_line(const Json& row, const std::vector<std::string>& keys);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_CSV_TEXT_H_
