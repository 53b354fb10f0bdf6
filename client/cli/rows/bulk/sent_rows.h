// Lines of the input that a sent batch was made from, so that an error of the server about an item can name its line.
// For the commands that send rows. Plain data and one lookup.
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
  uint64_t first_row = 0;           // index in the input of the first row
  std::vector<uint64_t> lines;      // line of each row
  std::vector<size_t> list_starts;  // first row of each of the batch's lists (blocks, inserts, moves)

  size_t rows() const { return lines.size(); }

  // Returns the line of entry `index` of the list that `field` names ("moves[3].ids", "blocks[0].rays.directions",
  // "remove_ids"); none if that is not a row.
  std::optional<uint64_t> line_of(absl::string_view field, size_t index) const;

  // Returns the first and last line as "17" or "17-8208"; empty without rows.
  std::string line_range() const;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_BULK_SENT_ROWS_H_
