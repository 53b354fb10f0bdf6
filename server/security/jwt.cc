#include "server/security/jwt.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "core/base/planted_bug.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "server/security/security_limits.h"

namespace locus::server {
namespace {

constexpr size_t kMaxTriedKeys = 4;       // maximum number of keys that are tried for one JWT
constexpr double kMaxUnixSeconds = 1e11;  // year 5138: far below what int64_t holds

absl::Status not_accepted(absl::string_view why) {
  return absl::UnauthenticatedError(absl::StrCat("the JWT is not accepted: ", why));
}

// Decodes base64url without padding. Returns false for anything else.
bool decode(absl::string_view part, std::string& bytes) {
  const auto good = [](char c) { return absl::ascii_isalnum(c) || c == '-' || c == '_'; };
  return !part.empty() && std::all_of(part.begin(), part.end(), good) && absl::WebSafeBase64Unescape(part, &bytes);
}

// Reads a time claim in seconds since 1970; `time` gets no value if the claim is absent.
absl::Status read_time(const json_t* claims, const char* name, std::optional<double>& time) {
  const json_t* const value = json_object_get(claims, name);
  if (value == nullptr) return absl::OkStatus();
  if (!json_is_number(value)) return not_accepted(absl::StrCat("its claim ", name, " is no number"));
  time = json_number_value(value);
  if (*time >= 0 && *time <= kMaxUnixSeconds) return absl::OkStatus();
  return not_accepted(absl::StrCat("its claim ", name, " is no time"));
}

absl::Status check_times(const json_t* claims, int64_t now) {
  const auto seconds = static_cast<double>(now);
  std::optional<double> expires, not_before, issued;
  RETURN_IF_ERROR(read_time(claims, "exp", expires));
  RETURN_IF_ERROR(read_time(claims, "nbf", not_before));
  RETURN_IF_ERROR(read_time(claims, "iat", issued));
  if (!expires) return not_accepted("it has no claim exp, so it would be valid for ever");
  const bool expired = seconds >= *expires + kJwtSkewSeconds;
  if (expired && !planted(PlantedBug::kJwtNeverExpires)) return not_accepted("it has expired");
  if (not_before && seconds < *not_before - kJwtSkewSeconds) return not_accepted("it is not valid yet (nbf)");
  if (issued && seconds < *issued - kJwtSkewSeconds) return not_accepted("it was issued in the future (iat)");
  return absl::OkStatus();
}

// Returns whether the claim `aud`, a string or a list of strings, names the audience.
bool names_audience(const json_t* claim, absl::string_view audience) {
  if (json_is_string(claim)) return json_text(claim) == audience;
  for (size_t i = 0; i < json_array_size(claim); ++i) {
    const json_t* const entry = json_array_get(claim, i);
    if (json_is_string(entry) && json_text(entry) == audience) return true;
  }
  return false;
}

// Returns the first second in which the JWT is no longer accepted.
int64_t end_of(const json_t* claims) {
  return static_cast<int64_t>(std::ceil(json_number_value(json_object_get(claims, "exp")))) + kJwtSkewSeconds;
}

// Members of a JWT's header that are used.
struct JwtHeader {
  SignatureAlgorithm algorithm = SignatureAlgorithm::kRs256;
  std::optional<std::string> key_id;
};

absl::StatusOr<JwtHeader> read_header(absl::string_view text) {
  const JsonPointer header = parse_json_object(text);
  if (header == nullptr) return not_accepted("its header is no JSON object");
  // Refuse extensions that must be understood (crit) and compression, because this verifier supports none of them.
  for (const char* const name : {"crit", "zip", "b64"})
    if (json_object_get(header.get(), name) != nullptr)
      return not_accepted(absl::StrCat("its header has the unsupported member ", name));
  const auto algorithm = signature_algorithm_named(json_text(json_object_get(header.get(), "alg")));
  if (!algorithm) return not_accepted("its algorithm is none of RS256, ES256 and EdDSA");
  JwtHeader read;
  read.algorithm = *algorithm;
  if (const json_t* const id = json_object_get(header.get(), "kid")) {
    if (!json_is_string(id)) return not_accepted("its kid is no string");
    read.key_id = std::string(json_text(id));
  }
  return read;
}

}  // namespace

absl::StatusOr<JwtVerifier> JwtVerifier::parse(absl::string_view file, absl::string_view text,
                                               absl::string_view audience, absl::string_view issuer,
                                               std::vector<std::string>& warnings) {
  if (audience.empty())
    return refuse_argument(Reason::kMalformed, "jwt_audience", {},
                           "must be set with a JWKS file: JWTs made for other services would be accepted otherwise");
  const JsonPointer set = text.size() > kMaxSecurityFileBytes ? nullptr : parse_json_object(text);
  const json_t* const keys = json_object_get(set.get(), "keys");
  const size_t count = json_array_size(keys);
  if (count == 0 || count > kMaxKeys)
    return refuse_argument(Reason::kMalformed, file, {},
                           absl::StrCat("must be a JSON object with an array `keys` of 1 to ", kMaxKeys, " keys"));
  JwtVerifier verifier;
  verifier.audience_ = std::string(audience);
  verifier.issuer_ = std::string(issuer);
  for (size_t i = 0; i < count; ++i) {
    absl::StatusOr<SignatureKey> key = SignatureKey::read(json_array_get(keys, i));
    const std::string place = absl::StrCat(file, ": keys[", i, "]: ");
    if (key.ok()) {
      verifier.keys_.push_back(*std::move(key));
    } else if (absl::IsUnimplemented(key.status())) {
      warnings.push_back(absl::StrCat(place, "skipped: ", key.status().message()));
    } else {
      return refuse_argument(Reason::kMalformed, absl::StrCat(file, ": keys"), static_cast<uint32_t>(i),
                             key.status().message());
    }
  }
  if (!verifier.keys_.empty()) return verifier;
  return refuse_argument(Reason::kMalformed, file, {}, "no key can verify RS256, ES256 (P-256) or EdDSA (Ed25519)");
}

absl::Status JwtVerifier::check_signature(absl::string_view header, absl::string_view signed_text,
                                          absl::string_view signature, const SignatureKey** key) const {
  if (planted(PlantedBug::kJwtWithoutAlgorithm) && absl::StrContains(header, "\"none\"")) {
    *key = &keys_.front();
    return absl::OkStatus();
  }
  ASSIGN_OR_RETURN(const JwtHeader read, read_header(header));
  std::vector<const SignatureKey*> candidates;
  for (const SignatureKey& candidate : keys_)
    if ((candidate.algorithm() == read.algorithm || planted(PlantedBug::kJwtKeyOfAnotherKind)) &&
        (!read.key_id || *read.key_id == candidate.id()))
      candidates.push_back(&candidate);
  if (candidates.empty()) return not_accepted("there is no key with its kid and algorithm");
  if (candidates.size() > kMaxTriedKeys) return not_accepted("several keys fit, so its header must have a kid");
  for (const SignatureKey* const candidate : candidates) {
    if (!candidate->verifies(signed_text, signature) && !planted(PlantedBug::kJwtAnySignature)) continue;
    *key = candidate;
    return absl::OkStatus();
  }
  return not_accepted("its signature is wrong");
}

absl::Status JwtVerifier::check_claims(const json_t* claims, int64_t now) const {
  if (claims == nullptr) return not_accepted("its payload is no JSON object");
  RETURN_IF_ERROR(check_times(claims, now));
  if (!names_audience(json_object_get(claims, "aud"), audience_) && !planted(PlantedBug::kJwtForAnyone))
    return not_accepted("it is for another audience");
  if (!issuer_.empty() && json_text(json_object_get(claims, "iss")) != issuer_)
    return not_accepted("it is from another issuer");
  return absl::OkStatus();
}

absl::StatusOr<IdentityPtr> JwtVerifier::verify(absl::string_view jwt, int64_t now) const {
  if (jwt.size() > kMaxJwtBytes) return not_accepted(absl::StrCat("it is longer than ", kMaxJwtBytes, " bytes"));
  const std::vector<absl::string_view> parts = absl::StrSplit(jwt, absl::MaxSplits('.', 3));
  std::array<std::string, 3> decoded;
  bool good = parts.size() == decoded.size();
  for (size_t i = 0; good && i < decoded.size(); ++i) good = decode(parts[i], decoded[i]);
  if (!good) return not_accepted("it is not three parts of base64url with dots between them");
  const SignatureKey* key = nullptr;
  const absl::string_view signed_text = jwt.substr(0, parts[0].size() + 1 + parts[1].size());
  RETURN_IF_ERROR(check_signature(decoded[0], signed_text, decoded[2], &key));
  const JsonPointer claims = parse_json_object(decoded[1]);
  RETURN_IF_ERROR(check_claims(claims.get(), now));
  const absl::StatusOr<std::string> principal =
      principal_of(IdentityKind::kJwt, json_text(json_object_get(claims.get(), "sub")));
  if (!principal.ok()) return not_accepted("its claim sub is absent, empty or too long");
  auto identity = std::make_shared<Identity>();
  identity->kind = IdentityKind::kJwt;
  identity->principal = *principal;
  identity->expires = end_of(claims.get());
  identity->credential = key->thumbprint();
  return identity;
}

bool JwtVerifier::has_key(absl::string_view thumbprint) const {
  return std::any_of(keys_.begin(), keys_.end(),
                     [&](const SignatureKey& key) { return key.thumbprint() == thumbprint; });
}

}  // namespace locus::server
