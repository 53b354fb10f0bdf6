// Schema of a bulk input (the columns that it may have), and a batch of rows, stored by column. For the row readers and
// the commands that read rows. Plain data and lookups by name.
//
// A column has the name of the command's option without the leading dashes: from, dir, t_max (or t-max). Exception:
// capsules and sweeps have the column way, the vector from `from` to the other end, instead of to.
// The parts of a vector are from.x, from.y, from.z in csv; ndjson also allows "from": [x, y, z].
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
  kCoordinate,  // |x| <= 1e9, stored as double
  kFloat,       // within the finite range of float
  kDistance,    // float, 0 or more; +infinity is allowed
  kId,          // unsigned, 64 bits
  kBits,        // unsigned, 32 bits
  kWord,        // one of Field::words, stored as its index in that list
  kJson,        // a JSON list, stored as its text, which the command reads
};

struct Field {
  std::string name;
  FieldKind kind = FieldKind::kFloat;
  std::string parts = {};  // names of a vector's parts, such as "xyz"; empty for one value
  std::vector<std::string> aliases = {};
  bool required = false;
  // Option that sets this field for all rows, so that the input must not have the column; empty = none.
  std::string option = {};
  std::vector<std::string> words = {};
  // Name of a field that a row must have if it has this field; empty = none.
  std::string needs = {};

  size_t size() const { return parts.empty() ? 1 : parts.size(); }
};

using RowSchema = std::vector<Field>;

// Reference to a field of the schema or to one part of a vector field: the index of the field, and the index of the
// part. A slot without `part` refers to the whole field.
struct Slot {
  size_t field = 0;
  std::optional<size_t> part = std::nullopt;
};

// Returns the slot with this name, for example "from.x" or "from"; nullopt if the schema has no such field or part.
std::optional<Slot> find_slot(const RowSchema& schema, absl::string_view name);

// Returns the name of a slot: "from.x" for one part, "from" for the whole field.
std::string slot_name(const RowSchema& schema, const Slot& slot);

// Returns the names of all csv columns of the schema, for messages: "from.x, from.y, ...".
std::string known_columns(const RowSchema& schema);

// Values of one field for all rows of a batch. Depending on the field's kind, either `numbers` (Field::size() entries
// per row), `integers` (one entry per row) or `texts` (one entry per row) is filled. `given` has one entry per row: 1
// if the row has a value, otherwise 0. If a row has no value, its entries in `numbers` or `integers` are 0, and in
// `texts` empty.
struct RowColumn {
  std::vector<double> numbers;
  std::vector<uint64_t> integers;
  std::vector<std::string> texts = {};
  std::vector<uint8_t> given;

  bool any() const;
  bool all() const;
};

struct RowBatch {
  std::vector<RowColumn> columns;  // one per field of the schema
  std::vector<uint64_t> lines;     // line of the input where each row begins, from 1
  uint64_t first_row = 0;          // index of the batch's first row in the whole input

  size_t rows() const { return lines.size(); }
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_BULK_ROW_SCHEMA_H_
