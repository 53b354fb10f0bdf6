#include "server/security/signature_key.h"

#include <openssl/bn.h>
#include <openssl/ec.h>
#include <openssl/err.h>
#include <openssl/x509.h>
#include <rhonabwy.h>

#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace locus::server {
namespace {

constexpr int kMinRsaBits = 2048;
constexpr int kMaxRsaBits = 8192;  // verification takes time quadratic in the size
constexpr size_t kMaxKeyDerBytes = 4096;
constexpr size_t kEs256HalfBytes = 32;  // a signature is two numbers of this size

// Type of key, and the algorithm that is used with it.
struct KeyType {
  absl::string_view type;   // member `kty`
  absl::string_view curve;  // member `crv`; empty = none
  absl::string_view name;   // name of the algorithm
  SignatureAlgorithm algorithm;
  int openssl_type;
};
constexpr KeyType kKeyTypes[] = {
    {"RSA", "", "RS256", SignatureAlgorithm::kRs256, EVP_PKEY_RSA},
    {"EC", "P-256", "ES256", SignatureAlgorithm::kEs256, EVP_PKEY_EC},
    {"OKP", "Ed25519", "EdDSA", SignatureAlgorithm::kEdDsa, EVP_PKEY_ED25519},
};

struct JwkFree {
  void operator()(jwk_t* jwk) const { r_jwk_free(jwk); }
};
using JwkPointer = std::unique_ptr<jwk_t, JwkFree>;

absl::string_view member_text(const json_t* object, const char* name) {
  return json_text(json_object_get(object, name));
}

// Returns UNIMPLEMENTED if the key's `use`, `alg` or `key_ops` excludes verifying signatures with the algorithm of
// `type`.
absl::Status check_use(const json_t* jwk, const KeyType& type) {
  const json_t* const use = json_object_get(jwk, "use");
  if (use != nullptr && json_text(use) != "sig") return absl::UnimplementedError("its `use` is not sig");
  const json_t* const algorithm = json_object_get(jwk, "alg");
  if (algorithm != nullptr && json_text(algorithm) != type.name)
    return absl::UnimplementedError(absl::StrCat("its `alg` is not ", type.name));
  const json_t* const operations = json_object_get(jwk, "key_ops");
  if (operations == nullptr) return absl::OkStatus();
  for (size_t i = 0; i < json_array_size(operations); ++i)
    if (json_text(json_array_get(operations, i)) == "verify") return absl::OkStatus();
  return absl::UnimplementedError("its `key_ops` do not include verify");
}

// Returns the type of a key; INVALID_ARGUMENT for a key that must not be in the file.
absl::StatusOr<const KeyType*> type_of(const json_t* jwk) {
  if (!json_is_object(jwk)) return absl::InvalidArgumentError("it is no JSON object");
  const absl::string_view name = member_text(jwk, "kty");
  if (name == "oct" || json_object_get(jwk, "k") != nullptr || json_object_get(jwk, "d") != nullptr)
    return absl::InvalidArgumentError("it is secret: the file may have public keys only");
  for (const KeyType& type : kKeyTypes)
    if (name == type.type && (type.curve.empty() || type.curve == member_text(jwk, "crv"))) return &type;
  return absl::UnimplementedError("its type is none of RSA, EC with P-256 and OKP with Ed25519");
}

// Returns the key with only the members that define it: no certificates, and no addresses to fetch them from.
absl::StatusOr<JwkPointer> essential_jwk(const json_t* jwk) {
  const JsonPointer essential(json_object());
  for (const char* const name : {"kty", "crv", "n", "e", "x", "y"})
    if (json_t* const value = json_object_get(jwk, name)) json_object_set(essential.get(), name, value);
  jwk_t* made = nullptr;
  if (r_jwk_init(&made) != RHN_OK) return absl::ResourceExhaustedError("there is no memory for it");
  JwkPointer owned(made);
  if (r_jwk_import_from_json_t(made, essential.get()) != RHN_OK || r_jwk_is_valid(made) != RHN_OK)
    return absl::InvalidArgumentError("its members are missing or malformed");
  return owned;
}

// Converts a key to OpenSSL's form; returns null if the key is invalid.
EVP_PKEY* to_openssl(jwk_t* jwk) {
  unsigned char der[kMaxKeyDerBytes];
  size_t size = sizeof der;
  if (r_jwk_export_to_pem_der(jwk, R_FORMAT_DER, der, &size, R_FLAG_IGNORE_REMOTE) != RHN_OK) return nullptr;
  const unsigned char* position = der;
  return d2i_PUBKEY(nullptr, &position, static_cast<long>(size));
}

// Returns an error if the type of the key differs from `type`. Also returns an error if the key is too weak, is so
// large that verification is slow, or is not on its curve.
absl::Status check_key(EVP_PKEY* key, const KeyType& type) {
  if (key == nullptr || EVP_PKEY_get_base_id(key) != type.openssl_type)
    return absl::InvalidArgumentError("its public key is malformed");
  const int bits = EVP_PKEY_get_bits(key);
  if (type.algorithm == SignatureAlgorithm::kRs256 && (bits < kMinRsaBits || bits > kMaxRsaBits))
    return absl::InvalidArgumentError(absl::StrCat("it has ", bits, " bits, not ", kMinRsaBits, " to ", kMaxRsaBits));
  if (type.algorithm == SignatureAlgorithm::kEdDsa) return absl::OkStatus();
  EVP_PKEY_CTX* const context = EVP_PKEY_CTX_new(key, nullptr);
  const bool good = context != nullptr && EVP_PKEY_public_check(context) == 1;
  EVP_PKEY_CTX_free(context);
  return good ? absl::OkStatus() : absl::InvalidArgumentError("its public key is no valid point or number");
}

// Converts an ES256 signature to DER, the form that OpenSSL reads. Returns an empty text if its size is wrong.
std::string es256_to_der(absl::string_view signature) {
  if (signature.size() != 2 * kEs256HalfBytes) return {};
  const auto* const bytes = reinterpret_cast<const unsigned char*>(signature.data());
  ECDSA_SIG* const pair = ECDSA_SIG_new();
  BIGNUM* const r = BN_bin2bn(bytes, kEs256HalfBytes, nullptr);
  BIGNUM* const s = BN_bin2bn(bytes + kEs256HalfBytes, kEs256HalfBytes, nullptr);
  std::string der;
  if (pair != nullptr && r != nullptr && s != nullptr && ECDSA_SIG_set0(pair, r, s) == 1) {
    unsigned char* encoded = nullptr;
    const int size = i2d_ECDSA_SIG(pair, &encoded);
    if (size > 0) der.assign(reinterpret_cast<const char*>(encoded), static_cast<size_t>(size));
    OPENSSL_free(encoded);
  } else {
    BN_free(r);
    BN_free(s);
  }
  ECDSA_SIG_free(pair);
  return der;
}

}  // namespace

std::optional<SignatureAlgorithm> signature_algorithm_named(absl::string_view name) {
  for (const KeyType& type : kKeyTypes)
    if (type.name == name) return type.algorithm;
  return std::nullopt;
}

absl::StatusOr<SignatureKey> SignatureKey::read(const json_t* jwk) {
  ASSIGN_OR_RETURN(const KeyType* const type, type_of(jwk));
  RETURN_IF_ERROR(check_use(jwk, *type));
  ASSIGN_OR_RETURN(const JwkPointer essential, essential_jwk(jwk));
  SignatureKey key;
  key.algorithm_ = type->algorithm;
  key.id_ = std::string(member_text(jwk, "kid"));
  key.key_.reset(to_openssl(essential.get()));
  absl::Status status = check_key(key.key_.get(), *type);
  ERR_clear_error();
  RETURN_IF_ERROR(status);
  char* const thumbprint = r_jwk_thumbprint(essential.get(), R_JWK_THUMB_SHA256, R_FLAG_IGNORE_REMOTE);
  if (thumbprint == nullptr) return absl::InternalError("its thumbprint cannot be computed");
  key.thumbprint_ = thumbprint;
  r_free(thumbprint);
  return key;
}

bool SignatureKey::verifies(absl::string_view text, absl::string_view signature) const {
  std::string der;
  if (algorithm_ == SignatureAlgorithm::kEs256) {
    der = es256_to_der(signature);
    signature = der;
  }
  if (signature.empty()) return false;
  const EVP_MD* const digest = algorithm_ == SignatureAlgorithm::kEdDsa ? nullptr : EVP_sha256();
  EVP_MD_CTX* const context = EVP_MD_CTX_new();
  const bool good =
      context != nullptr && EVP_DigestVerifyInit(context, nullptr, digest, nullptr, key_.get()) == 1 &&
      EVP_DigestVerify(context, reinterpret_cast<const unsigned char*>(signature.data()), signature.size(),
                       reinterpret_cast<const unsigned char*>(text.data()), text.size()) == 1;
  EVP_MD_CTX_free(context);
  ERR_clear_error();
  return good;
}

}  // namespace locus::server
