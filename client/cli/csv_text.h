// Rows as csv text (RFC 4180, but lines end with a line feed only). For the report stream. Functions without state.
//
// The columns of a row depend only on its keys, never on its values, so that the header is the same for every result. A
// key that names a vector is split into several columns (`normal.x,normal.y,normal.z`, `uv.u,uv.v`, `rotation.x` ..
// `rotation.w`). Any other key is one column; a list or an object in such a column is one cell of JSON text.
#ifndef LOCUS_CLIENT_CLI_CSV_TEXT_H_
#define LOCUS_CLIENT_CLI_CSV_TEXT_H_

#include <string>
#include <vector>

#include "client/cli/output.h"

namespace locus::cli {

// Returns the header line, without a line feed.
std::string csv_header(const std::vector<std::string>& keys);

// Returns the line of one row, without a line feed. Null and absent values are empty cells. A text is quoted if it
// contains a comma, a quote or a line break, or has a blank at either end. An empty text is written as two quotes, to
// distinguish it from null.
std::string csv_line(const Json& row, const std::vector<std::string>& keys);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_CSV_TEXT_H_
