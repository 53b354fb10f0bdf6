// Limits of the exporter. An error for size names the exceeded limit. Constants only.
#ifndef LOCUS_CLIENT_CLI_LEVELS_EXPORT_EXPORT_LIMITS_H_
#define LOCUS_CLIENT_CLI_LEVELS_EXPORT_EXPORT_LIMITS_H_

#include <cstddef>
#include <cstdint>

namespace locus::cli {

// Maximum number of nodes in a file. A capsule needs four nodes, any other object or instance one.
inline constexpr size_t kMaxExportNodes = size_t{1} << 20;
// Maximum size of a file in bytes: the GLB format stores sizes in 32 bits.
inline constexpr uint64_t kMaxExportBytes = UINT32_MAX;
// Maximum number of parts of a mesh. A mesh with more is written as a single part.
inline constexpr size_t kMaxExportParts = 4096;

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_EXPORT_EXPORT_LIMITS_H_
