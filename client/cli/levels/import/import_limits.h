// The maxima of the importers. Every refusal for size names one of them. Constants only.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_IMPORT_LIMITS_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_IMPORT_LIMITS_H_

#include <cstddef>
#include <cstdint>

namespace locus::cli {

inline constexpr uint64_t kMaxImportFileBytes = uint64_t{4} << 30;
inline constexpr size_t kMaxImportTriangles = size_t{1} << 27;
// Formats without shared vertices bring three for each triangle.
inline constexpr size_t kMaxImportVertices = 3 * kMaxImportTriangles;
static_assert(kMaxImportVertices <= UINT32_MAX, "a vertex number must fit an index");

inline constexpr size_t kMaxImportParts = 4096;
inline constexpr size_t kMaxPartNameBytes = 128;
// The same bound as the server's on frames and coordinates.
inline constexpr double kMaxImportCoordinate = 1e9;

// Thirty times the largest level that the Quake 3 compiler writes.
inline constexpr size_t kMaxBspBytes = size_t{256} << 20;
inline constexpr size_t kMaxBspTriangles = size_t{1} << 24;
inline constexpr int kMaxPatchSubdivisions = 64;
inline constexpr int64_t kMaxArchiveEntries = int64_t{1} << 20;
inline constexpr size_t kMaxListedEntries = 64;
static_assert(kMaxBspTriangles <= kMaxImportTriangles);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_IMPORT_LIMITS_H_
