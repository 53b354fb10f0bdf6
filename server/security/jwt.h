// Verifies JSON Web Tokens with the public keys of a JWKS file. Accepted algorithms: RS256, ES256 and EdDSA (Ed25519),
// each only with a key of its type; never `none`, and never a shared secret (HS256).
//
// Immutable; any thread. Sources: RFC 7515 (JWS), 7517 (JWK), 7519 (JWT), 8037 (EdDSA), 8725 (good practice).
#ifndef LOCUS_SERVER_SECURITY_JWT_H_
#define LOCUS_SERVER_SECURITY_JWT_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "server/security/identity.h"
#include "server/security/signature_key.h"

namespace locus::server {

class JwtVerifier {
 public:
  // Parses the text of a JWKS file; `file` is its name in errors. Keys that are not for signatures, and keys of types
  // that are not accepted, are skipped, with a sentence in `warnings`. Returns INVALID_ARGUMENT if the text is no JWKS,
  // contains a private or secret key, contains a key that is wrong or too weak (RSA below 2048 bits), or has no usable
  // key. Returns INVALID_ARGUMENT, too, if `audience` is empty.
  static absl::StatusOr<JwtVerifier> parse(absl::string_view file, absl::string_view text, absl::string_view audience,
                                           absl::string_view issuer, std::vector<std::string>& warnings);

  // Returns the identity `jwt:SUBJECT` that a JWT proves at `now` (seconds since 1970). Returns UNAUTHENTICATED, with
  // the reason, if the JWT's form, algorithm, signature, audience or issuer is wrong. Also returns UNAUTHENTICATED
  // if `now` is outside of the period of the claims nbf, iat and exp by more than kJwtSkewSeconds.
  absl::StatusOr<IdentityPtr> verify(absl::string_view jwt, int64_t now) const;

  // Returns whether a key with this thumbprint, as in Identity::credential, is in the file.
  bool has_key(absl::string_view thumbprint) const;

 private:
  JwtVerifier() = default;

  absl::Status check_signature(absl::string_view header, absl::string_view signed_text, absl::string_view signature,
                               const SignatureKey** key) const;
  absl::Status check_claims(const json_t* claims, int64_t now) const;

  std::vector<SignatureKey> keys_;
  std::string audience_;
  std::string issuer_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_JWT_H_
