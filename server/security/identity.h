// Identity of a caller, as grants, quotas and the audit log name it. Immutable and shared by the calls of a connection
// or stream; any thread.
#ifndef LOCUS_SERVER_SECURITY_IDENTITY_H_
#define LOCUS_SERVER_SECURITY_IDENTITY_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace locus::server {

// Source of an identity.
enum class IdentityKind : uint8_t {
  kAnonymous,    // no credentials
  kCertificate,  // client certificate, verified by TLS
  kToken,        // token of the token file
  kJwt,          // JWT signed by a key of the JWKS file
  kUser,         // user of the process at the other end of a unix socket
};

struct Identity {
  IdentityKind kind = IdentityKind::kAnonymous;
  std::string principal = "anonymous";  // "anonymous", cert:NAME, token:ID, jwt:SUBJECT or user:NAME
  std::optional<int64_t> expires;       // seconds since 1970 from which a token or JWT is no longer valid
  std::string credential;               // hash of the token, or thumbprint of the key that signed the JWT
};
using IdentityPtr = std::shared_ptr<const Identity>;

// Returns the identity of callers without credentials.
const IdentityPtr& anonymous_identity();

// Returns the principal of a name: the kind's prefix, then the name. In the name, `%XX` replaces each space, each of
// the characters `%`, `*` and `?`, and each byte that is not a printable ASCII character. Two names never have the same
// principal. Returns INVALID_ARGUMENT if the name is empty or the principal is longer than kMaxPrincipalBytes.
// Precondition: `kind` is not kAnonymous.
absl::StatusOr<std::string> principal_of(IdentityKind kind, absl::string_view name);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_IDENTITY_H_
