// The maxima of what the daemon tells about itself: metrics, health pages and logs. `locus limits` lists those that
// somebody may meet. Plain constants.
#ifndef LOCUS_SERVER_CONFIG_OBSERVABILITY_LIMITS_H_
#define LOCUS_SERVER_CONFIG_OBSERVABILITY_LIMITS_H_

#include <cstddef>
#include <cstdint>

namespace locus::server {

inline constexpr size_t kMaxLabelledScenes = 100;       // with figures of their own in /metrics, the rest in one sum
inline constexpr size_t kMaxRefusalNames = 64;          // counted apart in /metrics
inline constexpr uint32_t kHttpThreads = 2;             // that answer, one connection each
inline constexpr uint32_t kMaxHttpWaiting = 16;         // connections that wait for one of them
inline constexpr uint32_t kMaxHttpRequestBytes = 8192;  // request line and headers
inline constexpr uint32_t kHttpTimeoutMs = 2000;        // for a request to come, and for its answer to be taken
inline constexpr size_t kMaxRequestIdLength = 64;       // characters of a caller's x-request-id
inline constexpr uint32_t kMaxHealthWatchers = 32;      // each keeps a thread
inline constexpr uint32_t kMaxSlowQueryMs = 3'600'000;  // what --slow-query-ms may be
inline constexpr uint32_t kMaxSlowQueryLines = 10;      // logged a second, the rest are counted

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONFIG_OBSERVABILITY_LIMITS_H_
