// Limits of the importers. A file that exceeds a limit on bytes, vertices, triangles or archive entries is refused with
// an error that states the limit. The limits on parts, names and listed entries refuse nothing: see their comments.
// Constants only.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_IMPORT_LIMITS_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_IMPORT_LIMITS_H_

#include <cstddef>
#include <cstdint>

namespace locus::cli {

inline constexpr uint64_t kMaxImportFileBytes = uint64_t{4} << 30;
inline constexpr size_t kMaxImportTriangles = size_t{1} << 27;
// Maximum number of vertices. Formats without shared vertices store three vertices for each triangle.
inline constexpr size_t kMaxImportVertices = 3 * kMaxImportTriangles;
static_assert(kMaxImportVertices <= UINT32_MAX, "a vertex number must fit an index");

// Maximum number of parts of a mesh. All further triangles belong to the last part.
inline constexpr size_t kMaxImportParts = 4096;
// Maximum length of a part's name, which is truncated to it.
inline constexpr size_t kMaxPartNameBytes = 128;
// Maximum absolute value of a coordinate, equal to the server's limit for frames and coordinates.
inline constexpr double kMaxImportCoordinate = 1e9;

// Maximum size of a Quake 3 level in bytes: thirty times the largest level that the Quake 3 compiler writes.
inline constexpr size_t kMaxBspBytes = size_t{256} << 20;
inline constexpr size_t kMaxBspTriangles = size_t{1} << 24;
inline constexpr int kMaxPatchSubdivisions = 64;
inline constexpr int64_t kMaxArchiveEntries = int64_t{1} << 20;
// Maximum number of archive entries that a message lists.
inline constexpr size_t kMaxListedEntries = 64;
static_assert(kMaxBspTriangles <= kMaxImportTriangles);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_IMPORT_LIMITS_H_
