// Maxima of metrics, health pages and logs. `locus limits` lists the maxima that a user can reach. Plain constants.
#ifndef LOCUS_SERVER_CONFIG_OBSERVABILITY_LIMITS_H_
#define LOCUS_SERVER_CONFIG_OBSERVABILITY_LIMITS_H_

#include <cstddef>
#include <cstdint>

namespace locus::server {

inline constexpr size_t kMaxLabelledScenes = 100;    // scenes with their own label in /metrics; other scenes are summed
inline constexpr size_t kMaxRefusalNames = 64;       // pairs of reason and limit that /metrics counts separately
inline constexpr uint32_t kHttpThreads = 2;          // threads that make pages
inline constexpr uint32_t kMaxHttpConnections = 64;  // connections served concurrently; others wait in the kernel
inline constexpr uint32_t kMaxHttpRequestBytes = 8192;     // request line and headers
inline constexpr uint32_t kHttpTimeoutMs = 2000;           // timeout of TLS handshake plus request; again for the reply
inline constexpr size_t kMaxRequestIdLength = 64;          // characters of a caller's x-request-id
inline constexpr uint32_t kMaxHealthWatchers = 32;         // Watch calls of the health service; each occupies a thread
inline constexpr uint32_t kMaxHealthChecks = 32;           // concurrent Check calls of the health service
inline constexpr uint32_t kMaxReflections = 32;            // streams of server reflection; each occupies a thread
inline constexpr size_t kMaxReflectionRequestBytes = 512;  // bytes of one question to server reflection
inline constexpr uint32_t kMaxSlowQueryMs = 3'600'000;     // maximum of --slow-query-ms
inline constexpr uint32_t kMaxSlowQueryLines = 10;         // log lines a second; further slow queries are only counted
inline constexpr uint32_t kMaxLibraryLines = 10;  // log lines a second for gRPC's errors; further ones are only counted

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONFIG_OBSERVABILITY_LIMITS_H_
