// Which lines of an input a sent batch holds, so that what a server says about one of its items can be said about a
// line. For the commands that send rows. Plain data and one lookup.
#ifndef LOCUS_CLIENT_CLI_ROWS_BULK_SENT_ROWS_H_
#define LOCUS_CLIENT_CLI_ROWS_BULK_SENT_ROWS_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"

namespace locus::cli {

struct SentRows {
  uint64_t first_row = 0;           // of the input
  std::vector<uint64_t> lines;      // one a row
  std::vector<size_t> list_starts;  // where each of the batch's lists (blocks, inserts, moves) begins among the rows

  size_t rows() const { return lines.size(); }

  // The line of entry `index` of the list that `field` names ("moves[3].ids", "blocks[0].rays.directions",
  // "remove_ids"); nothing where that is no row.
  std::optional<uint64_t> line_of(absl::string_view field, size_t index) const;

  // "17" or "17-8208"; empty without rows.
  std::string line_range() const;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_BULK_SENT_ROWS_H_
