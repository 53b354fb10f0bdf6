// Rows as csv (RFC 4180, with a line feed at the end of a line): for the report stream. Functions without state.
//
// One rule says which columns a row has: a key that names a vector is split (`normal.x,normal.y,normal.z`, `uv.u,uv.v`,
// `rotation.x` .. `rotation.w`), every other key is one column. It goes by the key alone, so that a header does not
// depend on what was found. Other lists and objects are one cell of JSON.
#ifndef LOCUS_CLIENT_CLI_CSV_TEXT_H_
#define LOCUS_CLIENT_CLI_CSV_TEXT_H_

#include <string>
#include <vector>

#include "client/cli/output.h"

namespace locus::cli {

// The header's line, without its end.
std::string csv_header(const std::vector<std::string>& keys);

// One row's line, without its end. Null and absent values are empty cells; a text is quoted where it holds a comma, a
// quote, a line break or blanks at its ends, and where it is empty, since that is not null.
std::string csv_line(const Json& row, const std::vector<std::string>& keys);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_CSV_TEXT_H_
