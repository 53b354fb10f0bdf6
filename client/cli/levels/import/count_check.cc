#include "client/cli/levels/import/count_check.h"

#include <cstddef>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/cli/levels/import/import_error.h"
#include "client/cli/levels/import/import_limits.h"

namespace locus::cli {
namespace {

constexpr size_t kStlHeader = 84;    // 80 bytes of text, then the number of triangles
constexpr size_t kStlTriangle = 50;  // bytes of a triangle

// Calls `take` with each line, without blanks at its beginning.
template <class Take>
void for_each_line(absl::string_view bytes, const Take& take) {
  while (!bytes.empty()) {
    const size_t end = bytes.find('\n');
    take(absl::StripLeadingAsciiWhitespace(bytes.substr(0, end)));
    bytes.remove_prefix(end == absl::string_view::npos ? bytes.size() : end + 1);
  }
}

bool begins_with_word(absl::string_view line, absl::string_view word) {
  return absl::StartsWith(line, word) && line.size() > word.size() &&
         absl::ascii_isspace(static_cast<unsigned char>(line[word.size()]));
}

}  // namespace

ElementCounts count_obj(absl::string_view bytes) {
  ElementCounts counts;
  for_each_line(bytes, [&](absl::string_view line) {
    counts.vertices += begins_with_word(line, "v") ? 1 : 0;
    counts.triangles += begins_with_word(line, "f") ? 1 : 0;
  });
  return counts;
}

ElementCounts count_stl(absl::string_view bytes) {
  uint64_t triangles = 0;
  if (bytes.size() >= kStlHeader) {
    for (size_t i = 0; i < 4; ++i) triangles |= uint64_t{static_cast<uint8_t>(bytes[80 + i])} << (8 * i);
  }
  const bool is_binary = bytes.size() >= kStlHeader && triangles == (bytes.size() - kStlHeader) / kStlTriangle;
  if (!is_binary) {
    triangles = 0;
    for_each_line(bytes, [&](absl::string_view line) { triangles += begins_with_word(line, "facet") ? 1 : 0; });
  }
  return {3 * triangles, triangles};
}

absl::Status check_counts(const ElementCounts& counts) {
  constexpr absl::string_view kRemedy = "split it into several files";
  if (counts.triangles > kMaxImportTriangles) {
    return exceeds("the file", absl::StrCat(counts.triangles, " triangles"), "triangles", kMaxImportTriangles, kRemedy);
  }
  if (counts.vertices > kMaxImportVertices) {
    return exceeds("the file", absl::StrCat(counts.vertices, " vertices"), "vertices", kMaxImportVertices, kRemedy);
  }
  return absl::OkStatus();
}

}  // namespace locus::cli
