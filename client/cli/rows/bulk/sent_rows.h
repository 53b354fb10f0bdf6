// Line numbers of the rows in a sent batch. They are used to find the input line of an item that the server's error
// names. For the commands that send rows. Plain data and lookups.
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
  uint64_t first_row = 0;           // index of the first row in the whole input, from 0
  std::vector<uint64_t> lines;      // line of each row, from 1
  std::vector<size_t> list_starts;  // first row of each of the batch's lists (blocks, inserts, moves)

  size_t rows() const { return lines.size(); }

  // Returns the line of entry `index` of one of the batch's lists. `field` is the path of the list, in the form of the
  // server's errors ("moves[3].ids", "blocks[0].rays.directions", "remove_ids"). Returns nullopt if no row belongs to
  // that entry.
  std::optional<uint64_t> line_of(absl::string_view field, size_t index) const;

  // Returns the range of the batch's lines for messages, as "17" or "17-8208"; empty if the batch has no rows.
  std::string line_range() const;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_BULK_SENT_ROWS_H_
