// What columns a bulk input may have, and one batch of its rows in columns. For the row readers and the commands that
// read rows. Plain data, and one lookup.
//
// Names are those of the commands' options without the dashes, `-` written as `_` or left: from, dir, max_t. The parts
// of a vector are from.x, from.y, from.z in csv, and in ndjson either that or "from": [x, y, z].
#ifndef LOCUS_CLIENT_CLI_ROWS_BULK_ROW_SCHEMA_H_
#define LOCUS_CLIENT_CLI_ROWS_BULK_ROW_SCHEMA_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"

namespace locus::cli {

enum class FieldKind {
  kCoordinate,  // |x| <= 1e9, kept in double
  kFloat,       // finite as a float
  kDistance,    // 0 or more, infinity too
  kId,          // 64 bits
  kBits,        // 32 bits
  kWord,        // one of Field::words; kept as its place among them
};

struct Field {
  std::string name;
  FieldKind kind = FieldKind::kFloat;
  std::string parts = {};  // "xyz" or "xyzw" for a vector, empty for one value
  std::vector<std::string> aliases = {};
  bool required = false;
  std::string option = {};  // the option that gives the value for all rows; then the input must not have the column
  std::vector<std::string> words = {};

  size_t size() const { return parts.empty() ? 1 : parts.size(); }
};

using RowSchema = std::vector<Field>;

// A field, and a part of it; a vector's name alone stands for all of its parts.
struct Slot {
  size_t field = 0;
  std::optional<size_t> part = std::nullopt;
};

// Nothing for a name the schema does not know.
std::optional<Slot> find_slot(const RowSchema& schema, absl::string_view name);

// "from.x" for a part, "from" for a whole field.
std::string slot_name(const RowSchema& schema, const Slot& slot);

// All names of columns in csv, for messages: "from.x, from.y, ...".
std::string known_columns(const RowSchema& schema);

// One field of all rows of a batch. Either `numbers` (size() a row) or `integers` is filled, by kind; a row that does
// not give the field has zeros there and 0 in `given`.
struct RowColumn {
  std::vector<double> numbers;
  std::vector<uint64_t> integers;
  std::vector<uint8_t> given;

  bool any() const;
  bool all() const;
};

struct RowBatch {
  std::vector<RowColumn> columns;  // one a field of the schema
  std::vector<uint64_t> lines;     // where each row begins in the input, from 1
  uint64_t first_row = 0;          // how many rows of the input came before

  size_t rows() const { return lines.size(); }
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_BULK_ROW_SCHEMA_H_
