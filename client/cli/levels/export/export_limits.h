// The maxima of the exporter. Every refusal for size names one of them. Constants only.
#ifndef LOCUS_CLIENT_CLI_LEVELS_EXPORT_EXPORT_LIMITS_H_
#define LOCUS_CLIENT_CLI_LEVELS_EXPORT_EXPORT_LIMITS_H_

#include <cstddef>
#include <cstdint>

namespace locus::cli {

// A capsule takes four nodes, everything else one.
inline constexpr size_t kMaxExportNodes = size_t{1} << 20;
// The format counts its bytes in 32 bits.
inline constexpr uint64_t kMaxExportBytes = UINT32_MAX;
// A mesh of more parts is written as one.
inline constexpr size_t kMaxExportParts = 4096;

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_EXPORT_EXPORT_LIMITS_H_
