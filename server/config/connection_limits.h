// Maxima of the options about connections, TLS and audit. Plain constants.
#ifndef LOCUS_SERVER_CONFIG_CONNECTION_LIMITS_H_
#define LOCUS_SERVER_CONFIG_CONNECTION_LIMITS_H_

#include <cstdint>

namespace locus::server {

// Default of --max-connections, if the process may open enough files.
inline constexpr uint32_t kDefaultConnections = 4096;
inline constexpr uint32_t kMinConnections = 16;  // minimum of the default, even if few files may be open
// Maximum of --max-connections and --max-connections-per-address.
inline constexpr uint32_t kMaxConnections = 1'000'000;
inline constexpr uint32_t kMaxNewConnections = 100'000;        // maximum of --max-new-connections
inline constexpr uint32_t kMaxTimeoutS = 86'400;               // maximum of --handshake-timeout-s and --idle-timeout-s
inline constexpr uint32_t kFilesPerConnection = 2;             // descriptors that a connection uses
inline constexpr uint32_t kReservedFiles = 256;                // descriptors reserved for other uses than connections
inline constexpr uint64_t kMinAuditBytes = uint64_t{1} << 16;  // minimum of --audit-bytes

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONFIG_CONNECTION_LIMITS_H_
