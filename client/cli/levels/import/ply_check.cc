#include "client/cli/levels/import/ply_check.h"

#include <algorithm>
#include <string>

#include "absl/strings/ascii.h"
#include "absl/strings/str_split.h"
#include "client/cli/levels/import/count_check.h"
#include "client/cli/levels/import/ply_header.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

absl::Status check_binary_body(const PlyHeader& header, absl::string_view body) {
  for (const PlyElement& element : header.elements) {
    if (element.properties.empty()) continue;
    // A row takes at least one byte, so this loop ends at the end of the body even if the declared count is larger.
    for (uint64_t row = 0; row < element.count; ++row) {
      if (!skip_ply_row(element, header.encoding, body)) {
        return ends_within(element, row);
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
      return ends_within(element, lines);
    }
    lines -= element.count;
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<uint64_t> check_ply(absl::string_view bytes) {
  ASSIGN_OR_RETURN(const PlyHeader header, read_ply_header(bytes));
  uint64_t vertices = 0;
  uint64_t faces = 0;
  for (const PlyElement& element : header.elements) {
    if (element.name == "tristrips" && element.count > 0) {
      return absl::InvalidArgumentError(
          "the PLY file stores both faces and triangle strips (element tristrips), which is not supported: open it in "
          "MeshLab, Blender or the like and save it with faces");
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
