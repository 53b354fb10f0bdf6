// The header of a PLY file, and the walk over the rows of a binary body. For the other files about PLY in this folder.
// Plain data and functions without state. The bytes are untrusted.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_PLY_HEADER_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_PLY_HEADER_H_

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace locus::cli {

enum class PlyEncoding { kAscii, kLittleEndian, kBigEndian };

// Value of each row, or list of values.
struct PlyProperty {
  size_t value_bytes = 0;
  bool value_is_integer = false;
  bool value_is_signed = false;
  size_t count_bytes = 0;  // size of a list's length field; 0 if the property is not a list
  bool count_is_signed = false;
};

// Kind of rows, such as vertex or face.
struct PlyElement {
  std::string name;
  uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::kAscii;
  std::vector<PlyElement> elements;
  size_t body = 0;  // offset of the first byte after the header
};

// Returns INVALID_ARGUMENT with `what` and a remedy.
absl::Status damaged_ply(absl::string_view what);

// Returns the error of a body that ends within row `row` of `element`.
absl::Status ends_within(const PlyElement& element, uint64_t row);

// Parses the header. Returns damaged_ply() if it has no valid form.
absl::StatusOr<PlyHeader> read_ply_header(absl::string_view bytes);

// Returns the unsigned integer of `width` bytes at the front of `bytes`.
uint64_t read_ply_integer(absl::string_view bytes, size_t width, PlyEncoding encoding);

// Removes the length of a list from the front of `body`. Returns false if the body ends within it, or if it is
// negative.
bool read_ply_length(const PlyProperty& property, PlyEncoding encoding, absl::string_view& body, uint64_t& length);

// Removes one row of `element` from the front of `body`. Returns false if the body ends within the row.
bool skip_ply_row(const PlyElement& element, PlyEncoding encoding, absl::string_view& body);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_PLY_HEADER_H_
