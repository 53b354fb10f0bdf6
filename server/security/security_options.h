// Options of access control: the files that define which caller may do what, and the audit file, which records changes
// and refusals. Plain data.
#ifndef LOCUS_SERVER_SECURITY_SECURITY_OPTIONS_H_
#define LOCUS_SERVER_SECURITY_SECURITY_OPTIONS_H_

#include <cstdint>
#include <string>

namespace locus::server {

// If access_file, token_file and jwks_file are empty, access control is off: every caller is `anonymous` and may do
// everything.
struct SecurityOptions {
  // File of grants and quotas (see access_file.h). If access_file is empty but token_file or jwks_file is set, callers
  // with a valid token, JWT or certificate may do everything. All other callers may then do nothing.
  std::string access_file;

  // File of the tokens that are accepted (see token_file.h); empty = none.
  std::string token_file;

  // JSON Web Key Set with the public keys of the issuers of JWTs (see jwt.h); empty = JWTs are not accepted.
  std::string jwks_file;

  // Audience that a JWT must name; required with `jwks_file`.
  std::string jwt_audience;

  // Issuer that a JWT must name; empty = any issuer that signs with a key of `jwks_file`.
  std::string jwt_issuer;

  // File to which each change is appended as a line of JSON; refusals are appended to `audit_file`.refused (see
  // audit_log.h). Empty = none.
  std::string audit_file;

  // Size in bytes at which either of the two audit files gets the suffix .1 and a new file is begun; at least 65,536.
  uint64_t audit_bytes = uint64_t{64} << 20;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_SECURITY_OPTIONS_H_
