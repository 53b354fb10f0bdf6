// Limits and intervals of access control: security files, credentials, quotas and the audit log. Plain constants.
#ifndef LOCUS_SERVER_SECURITY_SECURITY_LIMITS_H_
#define LOCUS_SERVER_SECURITY_SECURITY_LIMITS_H_

#include <cstddef>
#include <cstdint>

#include "server/config/connection_limits.h"

namespace locus::server {

inline constexpr size_t kMaxSecurityFileBytes = 1u << 20;  // access file, token file, JWKS file
inline constexpr size_t kMaxAccessLines = 10'000;          // lines of an access file, comments included
inline constexpr size_t kMaxScenePatterns = 1024;          // patterns of one grant
inline constexpr size_t kMaxPatternBytes = 256;            // one pattern of a principal or of scenes
inline constexpr size_t kMaxTokens = 10'000;               // lines of a token file, comments included
inline constexpr size_t kMaxTokenIdLength = 63;
inline constexpr size_t kMaxKeys = 64;             // keys of a JWKS file
inline constexpr size_t kMaxPrincipalBytes = 256;  // text of a principal
inline constexpr size_t kMaxJwtBytes = 8192;
inline constexpr int64_t kJwtSkewSeconds = 60;  // maximum difference of the clocks of a JWT's issuer and the server

inline constexpr size_t kMaxQuotaSubjects = 65536;  // identities and connections whose use is counted
inline constexpr size_t kMaxAuditQueue = 4096;      // audit lines that wait for the writer
inline constexpr size_t kMaxAuditedPairs = 1024;    // pairs of principal and scene whose updates are counted
inline constexpr size_t kMaxAuditTextBytes = 1024;  // each text of an audit line
inline constexpr uint32_t kAuditFiles = 5;          // audit files kept: the current one and four older ones
// Pause between two polls of the watched files. A change takes effect when two successive polls find the same state.
inline constexpr uint32_t kFileWatchMilliseconds = 200;
inline constexpr uint32_t kFileRetryMilliseconds = 1000;  // pause before files that could not be used are read again

static_assert(kMaxAuditedPairs <= kMaxAuditQueue);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_SECURITY_LIMITS_H_
