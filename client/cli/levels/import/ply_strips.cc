#include "client/cli/levels/import/ply_strips.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client/cli/levels/import/count_check.h"
#include "client/cli/levels/import/import_limits.h"
#include "client/cli/levels/import/ply_header.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr absl::string_view kStrips = "tristrips";
constexpr int64_t kRestart = -1;

// Writer of the faces of strips, in the encoding of the file.
class FaceWriter {
 public:
  FaceWriter(PlyEncoding encoding, uint64_t vertices) : encoding_(encoding), vertices_(vertices) {}

  // Begins a strip.
  void restart() { length_ = 0; }

  // Adds the next index of the strip; kRestart ends the strip.
  absl::Status add(int64_t index) {
    if (index == kRestart) {
      restart();
      return absl::OkStatus();
    }
    if (index < 0 || static_cast<uint64_t>(index) >= vertices_)
      return damaged_ply(absl::StrCat("a triangle strip names vertex ", index, " of ", vertices_));
    if (length_ >= 2) RETURN_IF_ERROR(add_face(index));
    last_ = {last_[1], index};
    ++length_;
    return absl::OkStatus();
  }

  uint64_t faces() const { return faces_; }
  uint64_t vertices() const { return vertices_; }
  std::string take_bytes() { return std::move(bytes_); }

 private:
  absl::Status add_face(int64_t index) {
    const bool swapped = length_ % 2 == 1;
    const std::array<int64_t, 3> corners = {last_[swapped ? 1 : 0], last_[swapped ? 0 : 1], index};
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[0] == corners[2]) return absl::OkStatus();
    if (++faces_ > kMaxImportTriangles) return check_counts({vertices_, faces_});
    if (encoding_ == PlyEncoding::kAscii) {
      absl::StrAppend(&bytes_, "3 ", corners[0], " ", corners[1], " ", corners[2], "\n");
      return absl::OkStatus();
    }
    bytes_ += '\3';
    for (const int64_t corner : corners) {
      for (int i = 0; i < 4; ++i) {
        const int shift = encoding_ == PlyEncoding::kBigEndian ? 24 - 8 * i : 8 * i;
        bytes_ += static_cast<char>(static_cast<uint64_t>(corner) >> shift & 0xFF);
      }
    }
    return absl::OkStatus();
  }

  const PlyEncoding encoding_;
  const uint64_t vertices_;
  std::array<int64_t, 2> last_ = {};
  uint64_t length_ = 0;  // number of indices of the strip so far
  uint64_t faces_ = 0;
  std::string bytes_;
};

bool is_strips(const PlyElement& element) { return element.name == kStrips && element.count > 0; }

// Returns the index at the front of `bytes`; kRestart if all its bits are set, unless this is the number of a vertex.
int64_t read_index(const PlyProperty& property, PlyEncoding encoding, uint64_t vertices, absl::string_view bytes) {
  const uint64_t value = read_ply_integer(bytes, property.value_bytes, encoding);
  const uint64_t ones = property.value_bytes == 8 ? UINT64_MAX : (uint64_t{1} << (8 * property.value_bytes)) - 1;
  if (value == ones && (property.value_is_signed || value >= vertices)) return kRestart;
  const bool negative = property.value_is_signed && value >> (8 * property.value_bytes - 1) != 0;
  return negative ? INT64_MIN : static_cast<int64_t>(value);
}

// Removes a row of strips from the front of `body` and adds its faces.
absl::Status read_binary_row(const PlyElement& element, uint64_t row, PlyEncoding encoding, absl::string_view& body,
                             FaceWriter& faces) {
  const PlyProperty& property = element.properties.front();
  uint64_t count = 0;
  if (!read_ply_length(property, encoding, body, count) || count > body.size() / property.value_bytes)
    return ends_within(element, row);
  faces.restart();
  for (; count > 0; --count) {
    RETURN_IF_ERROR(faces.add(read_index(property, encoding, faces.vertices(), body)));
    body.remove_prefix(property.value_bytes);
  }
  return absl::OkStatus();
}

// Returns the body with the strips replaced by faces.
absl::StatusOr<std::string> binary_body(const PlyHeader& header, absl::string_view body, FaceWriter& faces) {
  std::string result;
  for (const PlyElement& element : header.elements) {
    const absl::string_view start = body;
    for (uint64_t row = 0; row < element.count && !element.properties.empty(); ++row) {
      if (is_strips(element)) {
        RETURN_IF_ERROR(read_binary_row(element, row, header.encoding, body, faces));
      } else if (!skip_ply_row(element, header.encoding, body)) {
        return ends_within(element, row);
      }
    }
    absl::StrAppend(&result, is_strips(element) ? faces.take_bytes() : start.substr(0, start.size() - body.size()));
  }
  return result;
}

absl::Status read_ascii_row(const PlyElement& element, uint64_t row, absl::string_view line, FaceWriter& faces) {
  const std::vector<absl::string_view> words = absl::StrSplit(line, absl::ByAnyChar(" \t\r"), absl::SkipEmpty());
  uint64_t count = 0;
  if (words.empty() || !absl::SimpleAtoi(words[0], &count) || count > words.size() - 1)
    return ends_within(element, row);
  faces.restart();
  for (size_t i = 1; i <= count; ++i) {
    int64_t index = 0;
    if (!absl::SimpleAtoi(words[i], &index)) return damaged_ply("a triangle strip has an index that is no number");
    RETURN_IF_ERROR(faces.add(index));
  }
  return absl::OkStatus();
}

// Returns the body with the strips replaced by faces. Each row is a line that is not empty.
absl::StatusOr<std::string> ascii_body(const PlyHeader& header, absl::string_view body, FaceWriter& faces) {
  std::string result;
  for (const PlyElement& element : header.elements) {
    for (uint64_t row = 0; row < element.count; ++row) {
      absl::string_view line;
      while (!body.empty() && absl::StripAsciiWhitespace(line).empty()) {
        line = body.substr(0, body.find('\n'));
        body.remove_prefix(std::min(body.size(), line.size() + 1));
      }
      if (absl::StripAsciiWhitespace(line).empty()) return ends_within(element, row);
      if (is_strips(element)) {
        RETURN_IF_ERROR(read_ascii_row(element, row, line, faces));
      } else {
        absl::StrAppend(&result, line, "\n");
      }
    }
    if (is_strips(element)) result += faces.take_bytes();
  }
  return result;
}

// Returns the header with `faces` faces declared instead of the strips.
std::string header_with_faces(absl::string_view head, uint64_t faces) {
  std::string result;
  bool in_strips = false;
  for (const absl::string_view line : absl::StrSplit(head, '\n')) {
    const std::vector<absl::string_view> words = absl::StrSplit(line, absl::ByAnyChar(" \t\r"), absl::SkipEmpty());
    if (words.empty()) continue;
    if (words[0] == "element") in_strips = words.size() > 1 && words[1] == kStrips;
    if (words[0] == "end_header") in_strips = false;
    if (in_strips && words[0] == "element")
      absl::StrAppend(&result, "element face ", faces, "\nproperty list uchar int vertex_indices\n");
    if (!in_strips) absl::StrAppend(&result, line, "\n");
  }
  return result;
}

}  // namespace

absl::StatusOr<std::optional<std::string>> unpack_ply_strips(absl::string_view bytes) {
  ASSIGN_OR_RETURN(const PlyHeader header, read_ply_header(bytes));
  uint64_t vertices = 0;
  size_t strips = 0;
  for (const PlyElement& element : header.elements) {
    if (element.name == "face" && element.count > 0) return std::nullopt;
    if (element.name == "vertex") vertices = element.count;
    if (!is_strips(element)) continue;
    ++strips;
    const bool known = element.properties.size() == 1 && element.properties.front().count_bytes > 0 &&
                       element.properties.front().value_is_integer;
    if (!known) return damaged_ply("the element tristrips is not one list of indices");
  }
  if (strips == 0) return std::nullopt;
  if (strips > 1) return damaged_ply("there is more than one element tristrips");
  FaceWriter faces(header.encoding, vertices);
  const absl::string_view body = bytes.substr(header.body);
  ASSIGN_OR_RETURN(const std::string unpacked, header.encoding == PlyEncoding::kAscii
                                                   ? ascii_body(header, body, faces)
                                                   : binary_body(header, body, faces));
  return absl::StrCat(header_with_faces(bytes.substr(0, header.body), faces.faces()), unpacked);
}

}  // namespace locus::cli
