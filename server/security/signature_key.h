// Public keys that verify signatures of JSON Web Tokens, read from JSON Web Keys by librhonabwy and used by OpenSSL.
// Immutable; any thread.
#ifndef LOCUS_SERVER_SECURITY_SIGNATURE_KEY_H_
#define LOCUS_SERVER_SECURITY_SIGNATURE_KEY_H_

#include <openssl/evp.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "server/security/json_value.h"

namespace locus::server {

// Algorithm of a signature. JWTs that name the algorithm `none` or one with a shared secret are never accepted.
enum class SignatureAlgorithm : uint8_t { kRs256, kEs256, kEdDsa };

// Returns the algorithm that RFC 7518 or RFC 8037 calls `name`, such as "RS256". Returns nullopt if that algorithm is
// not accepted.
std::optional<SignatureAlgorithm> signature_algorithm_named(absl::string_view name);

class SignatureKey {
 public:
  // Reads a JSON Web Key. Returns UNIMPLEMENTED with the reason if the key's type or use is not supported; the caller
  // should skip such a key. Returns INVALID_ARGUMENT for a key that is private, secret, too weak or wrong.
  static absl::StatusOr<SignatureKey> read(const json_t* jwk);

  SignatureAlgorithm algorithm() const { return algorithm_; }
  const std::string& id() const { return id_; }                  // member `kid`; empty = none
  const std::string& thumbprint() const { return thumbprint_; }  // SHA-256 of the public key, RFC 7638
  // Returns whether `signature` is this key's valid signature of `text`. Takes 20 to 150 us.
  bool verifies(absl::string_view text, absl::string_view signature) const;

 private:
  struct Free {
    void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
  };

  SignatureKey() = default;

  SignatureAlgorithm algorithm_ = SignatureAlgorithm::kRs256;
  std::string id_;
  std::string thumbprint_;
  std::unique_ptr<EVP_PKEY, Free> key_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_SIGNATURE_KEY_H_
