// Counts of the vertices and triangles of OBJ and STL files, and a check that these counts are within the limits. The
// counts are checked before assimp reads a file, because assimp needs about ten times the memory of the result. For the
// scene importer. Functions without state. PLY files have a check of their own: ply_check.h.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_COUNT_CHECK_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_COUNT_CHECK_H_

#include <cstdint>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace locus::cli {

struct ElementCounts {
  uint64_t vertices = 0;
  uint64_t triangles = 0;
};

// Returns the number of vertices of an OBJ file, and its number of faces as a lower bound of its number of triangles.
ElementCounts count_obj(absl::string_view bytes);

// Returns the counts of an STL file: three vertices for each triangle. The header of a binary file declares the number
// of triangles; in a text file, the facets are counted.
ElementCounts count_stl(absl::string_view bytes);

// Returns RESOURCE_EXHAUSTED naming the limit that the counts exceed; else OK.
absl::Status check_counts(const ElementCounts& counts);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_COUNT_CHECK_H_
