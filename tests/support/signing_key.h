// Keys that sign JSON Web Tokens for tests: made with OpenSSL for each run, so that no private key is stored. A key and
// its functions are used by one thread at a time.
#ifndef LOCUS_TESTS_SUPPORT_SIGNING_KEY_H_
#define LOCUS_TESTS_SUPPORT_SIGNING_KEY_H_

#include <openssl/bn.h>
#include <openssl/core_names.h>
#include <openssl/ec.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <openssl/pem.h>

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

namespace locus::test {

inline const unsigned char* bytes_of(absl::string_view text) {
  return reinterpret_cast<const unsigned char*>(text.data());
}
inline std::string base64url(absl::string_view bytes) { return absl::WebSafeBase64Escape(bytes); }

class SigningKey {
 public:
  static SigningKey rsa(unsigned bits = 2048) { return SigningKey("RS256", EVP_RSA_gen(bits)); }
  static SigningKey p256() { return SigningKey("ES256", EVP_EC_gen("P-256")); }
  static SigningKey ed25519() { return SigningKey("EdDSA", EVP_PKEY_Q_keygen(nullptr, nullptr, "ED25519")); }

  const std::string& algorithm() const { return algorithm_; }

  // Returns the public key as a JSON Web Key; `members` are further members, such as R"(,"kid":"a")".
  std::string jwk(absl::string_view members = "") const {
    if (algorithm_ == "RS256")
      return absl::StrCat(R"({"kty":"RSA","n":")", number(OSSL_PKEY_PARAM_RSA_N), R"(","e":")",
                          number(OSSL_PKEY_PARAM_RSA_E), "\"", members, "}");
    const std::string point = public_bytes();
    if (algorithm_ == "EdDSA")
      return absl::StrCat(R"({"kty":"OKP","crv":"Ed25519","x":")", base64url(point), "\"", members, "}");
    return absl::StrCat(R"({"kty":"EC","crv":"P-256","x":")", base64url(point.substr(1, 32)), R"(","y":")",
                        base64url(point.substr(33)), "\"", members, "}");
  }

  // Returns a JWT with this header and these claims, signed by this key even if the header names another algorithm.
  std::string jwt(absl::string_view header, absl::string_view claims) const {
    const std::string text = absl::StrCat(base64url(header), ".", base64url(claims));
    return absl::StrCat(text, ".", base64url(signature(text)));
  }

  std::string signature(const std::string& text) const {
    const EVP_MD* const digest = algorithm_ == "EdDSA" ? nullptr : EVP_sha256();
    EVP_MD_CTX* const context = EVP_MD_CTX_new();
    std::string signature(1024, '\0');
    size_t size = signature.size();
    EVP_DigestSignInit(context, nullptr, digest, nullptr, key_.get());
    EVP_DigestSign(context, reinterpret_cast<unsigned char*>(signature.data()), &size, bytes_of(text), text.size());
    EVP_MD_CTX_free(context);
    signature.resize(size);
    return algorithm_ == "ES256" ? pair_of(signature) : signature;
  }

  // Returns the public key in PEM, the form that attackers try to use as a shared secret.
  std::string pem() const {
    BIO* const memory = BIO_new(BIO_s_mem());
    PEM_write_bio_PUBKEY(memory, key_.get());
    char* data = nullptr;
    const long size = BIO_get_mem_data(memory, &data);
    const std::string text(data, static_cast<size_t>(size));
    BIO_free(memory);
    return text;
  }

 private:
  struct Free {
    void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
  };

  SigningKey(std::string algorithm, EVP_PKEY* key) : algorithm_(std::move(algorithm)), key_(key) {}

  std::string number(const char* name) const {
    BIGNUM* value = nullptr;
    EVP_PKEY_get_bn_param(key_.get(), name, &value);
    std::string bytes(static_cast<size_t>(BN_num_bytes(value)), '\0');
    BN_bn2bin(value, reinterpret_cast<unsigned char*>(bytes.data()));
    BN_free(value);
    return base64url(bytes);
  }
  std::string public_bytes() const {
    std::string bytes(256, '\0');
    size_t size = 0;
    EVP_PKEY_get_octet_string_param(key_.get(), OSSL_PKEY_PARAM_PUB_KEY, reinterpret_cast<unsigned char*>(bytes.data()),
                                    bytes.size(), &size);
    return bytes.substr(0, size);
  }
  // Returns the two numbers of an ECDSA signature, 32 bytes each.
  static std::string pair_of(const std::string& der) {
    const unsigned char* position = bytes_of(der);
    ECDSA_SIG* const pair = d2i_ECDSA_SIG(nullptr, &position, static_cast<long>(der.size()));
    std::string bytes(64, '\0');
    BN_bn2binpad(ECDSA_SIG_get0_r(pair), reinterpret_cast<unsigned char*>(bytes.data()), 32);
    BN_bn2binpad(ECDSA_SIG_get0_s(pair), reinterpret_cast<unsigned char*>(bytes.data()) + 32, 32);
    ECDSA_SIG_free(pair);
    return bytes;
  }

  std::string algorithm_;
  std::unique_ptr<EVP_PKEY, Free> key_;
};

// Returns a JWT with the signature HMAC-SHA256 of a shared secret.
inline std::string hmac_jwt(absl::string_view secret, absl::string_view header, absl::string_view claims) {
  const std::string text = absl::StrCat(base64url(header), ".", base64url(claims));
  unsigned char hash[EVP_MAX_MD_SIZE];
  unsigned size = 0;
  HMAC(EVP_sha256(), secret.data(), static_cast<int>(secret.size()), bytes_of(text), text.size(), hash, &size);
  return absl::StrCat(text, ".", base64url({reinterpret_cast<const char*>(hash), size}));
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_SIGNING_KEY_H_
