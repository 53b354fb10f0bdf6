#include "client/cli/levels/import/ply_header.h"

#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client/cli/levels/import/clean_text.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr size_t kMaxHeaderBytes = 1 << 16;
constexpr size_t kMaxShownBytes = 40;  // maximum length of a word of the file in a message

// Returns the size in bytes of a scalar type, or 0 if the type is unknown.
size_t type_bytes(absl::string_view type) {
  constexpr std::pair<absl::string_view, size_t> kTypes[] = {
      {"char", 1},  {"uchar", 1},   {"int8", 1},   {"uint8", 1},  {"short", 2}, {"ushort", 2},
      {"int16", 2}, {"uint16", 2},  {"int", 4},    {"uint", 4},   {"int32", 4}, {"uint32", 4},
      {"float", 4}, {"float32", 4}, {"double", 8}, {"float64", 8}};
  for (const auto& [name, bytes] : kTypes) {
    if (name == type) return bytes;
  }
  return 0;
}

bool is_integer_type(absl::string_view type) {
  return type.find("float") == absl::string_view::npos && type != "double";
}

absl::StatusOr<PlyProperty> read_property(const std::vector<absl::string_view>& words) {
  PlyProperty property;
  if (words.size() == 5 && words[1] == "list") {
    property.count_bytes = is_integer_type(words[2]) ? type_bytes(words[2]) : 0;
    property.count_is_signed = words[2].substr(0, 1) != "u";
    property.value_bytes = type_bytes(words[3]);
    property.value_is_integer = is_integer_type(words[3]);
    property.value_is_signed = words[3].substr(0, 1) != "u";
    if (property.count_bytes > 0 && property.value_bytes > 0) return property;
  } else if (words.size() == 3) {
    property.value_bytes = type_bytes(words[1]);
    if (property.value_bytes > 0) return property;
  }
  return damaged_ply(absl::StrCat("header property of unknown form: ", clean_text(words.back(), kMaxShownBytes)));
}

absl::Status read_format(const std::vector<absl::string_view>& words, PlyHeader& header) {
  const absl::string_view name = words.size() > 1 ? words[1] : "";
  if (name == "ascii") {
    header.encoding = PlyEncoding::kAscii;
  } else if (name == "binary_little_endian") {
    header.encoding = PlyEncoding::kLittleEndian;
  } else if (name == "binary_big_endian") {
    header.encoding = PlyEncoding::kBigEndian;
  } else {
    return damaged_ply(absl::StrCat("unknown format ", clean_text(name, kMaxShownBytes)));
  }
  return absl::OkStatus();
}

absl::Status read_header_line(const std::vector<absl::string_view>& words, PlyHeader& header) {
  if (words[0] == "format") return read_format(words, header);
  if (words[0] == "element") {
    PlyElement element;
    if (words.size() != 3 || !absl::SimpleAtoi(words[2], &element.count))
      return damaged_ply("element line without a count");
    element.name = clean_text(words[1], kMaxShownBytes);  // printed in messages
    header.elements.push_back(std::move(element));
  } else if (words[0] == "property") {
    if (header.elements.empty()) return damaged_ply("property before the first element");
    ASSIGN_OR_RETURN(const PlyProperty property, read_property(words));
    header.elements.back().properties.push_back(property);
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status damaged_ply(absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("damaged PLY: ", what, "; export the mesh again"));
}

absl::Status ends_within(const PlyElement& element, uint64_t row) {
  return damaged_ply(absl::StrCat("the file ends within ", element.name, "[", row, "] of ", element.count));
}

absl::StatusOr<PlyHeader> read_ply_header(absl::string_view bytes) {
  const absl::string_view head = bytes.substr(0, kMaxHeaderBytes);
  PlyHeader header;
  for (size_t start = 0, line = 0;; ++line) {
    const size_t end = head.find('\n', start);
    if (end == absl::string_view::npos) {
      return damaged_ply(absl::StrCat("no end_header line in the first ", kMaxHeaderBytes, " bytes"));
    }
    const absl::string_view text = head.substr(start, end - start);
    const std::vector<absl::string_view> words = absl::StrSplit(text, absl::ByAnyChar(" \t\r"), absl::SkipEmpty());
    start = end + 1;
    if (line == 0 && (words.empty() || words[0] != "ply")) return damaged_ply("the first line is not ply");
    if (words.empty()) continue;
    if (words[0] == "end_header") {
      header.body = start;
      return header;
    }
    RETURN_IF_ERROR(read_header_line(words, header));
  }
}

uint64_t read_ply_integer(absl::string_view bytes, size_t width, PlyEncoding encoding) {
  uint64_t value = 0;
  for (size_t i = 0; i < width; ++i) {
    const size_t at = encoding == PlyEncoding::kBigEndian ? i : width - 1 - i;
    value = value << 8 | static_cast<uint8_t>(bytes[at]);
  }
  return value;
}

bool read_ply_length(const PlyProperty& property, PlyEncoding encoding, absl::string_view& body, uint64_t& length) {
  if (body.size() < property.count_bytes) return false;
  length = read_ply_integer(body, property.count_bytes, encoding);
  if (property.count_is_signed && length >> (8 * property.count_bytes - 1) != 0) return false;
  body.remove_prefix(property.count_bytes);
  return true;
}

bool skip_ply_row(const PlyElement& element, PlyEncoding encoding, absl::string_view& body) {
  for (const PlyProperty& property : element.properties) {
    uint64_t count = 1;
    if (property.count_bytes > 0 && !read_ply_length(property, encoding, body, count)) return false;
    if (count > body.size() / property.value_bytes) return false;
    body.remove_prefix(count * property.value_bytes);
  }
  return true;
}

}  // namespace locus::cli
