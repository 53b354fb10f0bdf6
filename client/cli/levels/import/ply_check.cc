#include "client/cli/levels/import/ply_check.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client/cli/levels/import/clean_text.h"
#include "client/cli/levels/import/count_check.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr size_t kMaxHeaderBytes = 1 << 16;
constexpr size_t kMaxShownBytes = 40;  // maximum length of a word of the file in a message

enum class PlyEncoding { kAscii, kLittleEndian, kBigEndian };

struct PlyProperty {
  size_t value_bytes = 0;
  size_t count_bytes = 0;  // size of a list's length field; 0 if the property is not a list
  bool count_is_signed = false;
};

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

absl::Status damaged(absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("damaged PLY: ", what, "; export the mesh again"));
}

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

absl::StatusOr<PlyProperty> read_property(const std::vector<absl::string_view>& words) {
  PlyProperty property;
  if (words.size() == 5 && words[1] == "list") {
    const bool is_integer = words[2].find("float") == absl::string_view::npos && words[2] != "double";
    property.count_bytes = is_integer ? type_bytes(words[2]) : 0;
    property.count_is_signed = words[2].substr(0, 1) != "u";
    property.value_bytes = type_bytes(words[3]);
    if (property.count_bytes > 0 && property.value_bytes > 0) return property;
  } else if (words.size() == 3) {
    property.value_bytes = type_bytes(words[1]);
    if (property.value_bytes > 0) return property;
  }
  return damaged(absl::StrCat("header property of unknown form: ", clean_text(words.back(), kMaxShownBytes)));
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
    return damaged(absl::StrCat("unknown format ", clean_text(name, kMaxShownBytes)));
  }
  return absl::OkStatus();
}

absl::Status read_header_line(const std::vector<absl::string_view>& words, PlyHeader& header) {
  if (words[0] == "format") return read_format(words, header);
  if (words[0] == "element") {
    PlyElement element;
    if (words.size() != 3 || !absl::SimpleAtoi(words[2], &element.count))
      return damaged("element line without a count");
    element.name = clean_text(words[1], kMaxShownBytes);  // printed in messages
    header.elements.push_back(std::move(element));
  } else if (words[0] == "property") {
    if (header.elements.empty()) return damaged("property before the first element");
    ASSIGN_OR_RETURN(const PlyProperty property, read_property(words));
    header.elements.back().properties.push_back(property);
  }
  return absl::OkStatus();
}

absl::StatusOr<PlyHeader> read_header(absl::string_view bytes) {
  const absl::string_view head = bytes.substr(0, kMaxHeaderBytes);
  PlyHeader header;
  for (size_t start = 0, line = 0;; ++line) {
    const size_t end = head.find('\n', start);
    if (end == absl::string_view::npos) {
      return damaged(absl::StrCat("no end_header line in the first ", kMaxHeaderBytes, " bytes"));
    }
    const absl::string_view text = head.substr(start, end - start);
    const std::vector<absl::string_view> words = absl::StrSplit(text, absl::ByAnyChar(" \t\r"), absl::SkipEmpty());
    start = end + 1;
    if (line == 0 && (words.empty() || words[0] != "ply")) return damaged("the first line is not ply");
    if (words.empty()) continue;
    if (words[0] == "end_header") {
      header.body = start;
      return header;
    }
    RETURN_IF_ERROR(read_header_line(words, header));
  }
}

uint64_t read_count(absl::string_view bytes, size_t width, PlyEncoding encoding) {
  uint64_t count = 0;
  for (size_t i = 0; i < width; ++i) {
    const size_t at = encoding == PlyEncoding::kBigEndian ? i : width - 1 - i;
    count = count << 8 | static_cast<uint8_t>(bytes[at]);
  }
  return count;
}

// Removes one row of `element` from the front of `body`. Returns false if the body ends within the row.
bool skip_row(const PlyElement& element, PlyEncoding encoding, absl::string_view& body) {
  for (const PlyProperty& property : element.properties) {
    uint64_t count = 1;
    if (property.count_bytes > 0) {
      if (body.size() < property.count_bytes) return false;
      count = read_count(body, property.count_bytes, encoding);
      // Refuse a negative list length.
      if (property.count_is_signed && count >> (8 * property.count_bytes - 1) != 0) return false;
      body.remove_prefix(property.count_bytes);
    }
    if (count > body.size() / property.value_bytes) return false;
    body.remove_prefix(count * property.value_bytes);
  }
  return true;
}

absl::Status check_binary_body(const PlyHeader& header, absl::string_view body) {
  for (const PlyElement& element : header.elements) {
    if (element.properties.empty()) continue;
    // A row takes at least one byte, so this loop ends at the end of the body even if the declared count is larger.
    for (uint64_t row = 0; row < element.count; ++row) {
      if (!skip_row(element, header.encoding, body)) {
        return damaged(absl::StrCat("the file ends within ", element.name, "[", row, "] of ", element.count));
      }
    }
  }
  return absl::OkStatus();
}

// Checks that the body has at least one non-empty line for each row that the header declares.
absl::Status check_ascii_body(const PlyHeader& header, absl::string_view body) {
  uint64_t lines = 0;
  for (const absl::string_view line : absl::StrSplit(body, '\n')) {
    lines += absl::StripAsciiWhitespace(line).empty() ? 0 : 1;
  }
  for (const PlyElement& element : header.elements) {
    if (element.count > lines) {
      return damaged(absl::StrCat("the file ends within ", element.name, "[", lines, "] of ", element.count));
    }
    lines -= element.count;
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<uint64_t> check_ply(absl::string_view bytes) {
  ASSIGN_OR_RETURN(const PlyHeader header, read_header(bytes));
  uint64_t vertices = 0;
  uint64_t faces = 0;
  for (const PlyElement& element : header.elements) {
    if (element.name == "tristrips" && element.count > 0) {
      return absl::InvalidArgumentError(
          "the PLY file stores triangle strips (element tristrips), which are not supported: open it in MeshLab, "
          "Blender or the like and save it with faces");
    }
    if (element.name == "vertex") vertices += std::min(element.count, UINT64_MAX - vertices);
    if (element.name == "face") faces += std::min(element.count, UINT64_MAX - faces);
  }
  const absl::string_view body = bytes.substr(header.body);
  RETURN_IF_ERROR(header.encoding == PlyEncoding::kAscii ? check_ascii_body(header, body)
                                                         : check_binary_body(header, body));
  RETURN_IF_ERROR(check_counts({vertices, faces}));
  return faces;
}

}  // namespace locus::cli
