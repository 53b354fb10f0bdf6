#include "server/security/jwt.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "server/security/security_limits.h"
#include "tests/support/random.h"
#include "tests/support/signing_key.h"
#include "tests/support/test_scale.h"

namespace locus::server {
namespace {

using test::SigningKey;
using testing::HasSubstr;

constexpr int64_t kNow = 1'700'000'000;
constexpr const char* kAudience = "locus";
constexpr const char* kIssuer = "https://issuer.example";

const SigningKey& rsa_key() {
  static const auto* const key = new SigningKey(SigningKey::rsa());
  return *key;
}
const SigningKey& ec_key() {
  static const auto* const key = new SigningKey(SigningKey::p256());
  return *key;
}
const SigningKey& ed_key() {
  static const auto* const key = new SigningKey(SigningKey::ed25519());
  return *key;
}
std::vector<const SigningKey*> all_keys() { return {&rsa_key(), &ec_key(), &ed_key()}; }

// Returns a key set of the public keys with the ids k0, k1 and so on.
std::string key_set(const std::vector<const SigningKey*>& keys) {
  std::string text;
  for (size_t i = 0; i < keys.size(); ++i)
    absl::StrAppend(&text, i == 0 ? "" : ",", keys[i]->jwk(absl::StrCat(R"(,"kid":"k)", i, "\"")));
  return absl::StrCat(R"({"keys":[)", text, "]}");
}

absl::StatusOr<JwtVerifier> parsed(absl::string_view text, absl::string_view issuer = "") {
  std::vector<std::string> warnings;
  return JwtVerifier::parse("keys.json", text, kAudience, issuer, warnings);
}

JwtVerifier verifier(absl::string_view issuer = "") {
  absl::StatusOr<JwtVerifier> made = parsed(key_set(all_keys()), issuer);
  EXPECT_TRUE(made.ok()) << made.status();
  return *std::move(made);
}

std::string header_of(const SigningKey& key, absl::string_view members = "") {
  return absl::StrCat(R"({"typ":"JWT","alg":")", key.algorithm(), "\"", members, "}");
}
// Returns claims that are accepted at kNow, with further members.
std::string claims(absl::string_view members = "") {
  return absl::StrCat(R"({"sub":"ann","aud":"locus","exp":)", kNow + 100, members, "}");
}
std::string claims_replaced(absl::string_view from, absl::string_view to) {
  const std::string replaced = absl::StrReplaceAll(claims(), {{from, to}});
  EXPECT_NE(replaced, claims());
  return replaced;
}

void expect_refused(const JwtVerifier& by, absl::string_view jwt, absl::string_view why, int64_t now = kNow) {
  const absl::StatusOr<IdentityPtr> identity = by.verify(jwt, now);
  EXPECT_EQ(identity.status().code(), absl::StatusCode::kUnauthenticated) << why;
  EXPECT_THAT(std::string(identity.status().message()), HasSubstr(std::string(why)));
}

TEST(JwtTest, EachAlgorithmProvesTheSubject) {
  const JwtVerifier by = verifier();
  for (const SigningKey* const key : all_keys()) {
    const absl::StatusOr<IdentityPtr> identity = by.verify(key->jwt(header_of(*key), claims()), kNow);
    ASSERT_TRUE(identity.ok()) << key->algorithm() << identity.status();
    EXPECT_EQ((*identity)->principal, "jwt:ann");
    EXPECT_EQ((*identity)->kind, IdentityKind::kJwt);
    EXPECT_EQ((*identity)->expires, kNow + 100 + kJwtSkewSeconds);
    EXPECT_TRUE(by.has_key((*identity)->credential));
  }
}

TEST(JwtTest, AlgorithmNoneIsNeverAccepted) {
  const JwtVerifier by = verifier();
  for (const char* const name : {"none", "None", "NONE", "nOnE", ""}) {
    const std::string header = absl::StrCat(R"({"alg":")", name, R"("})");
    const std::string text = absl::StrCat(test::base64url(header), ".", test::base64url(claims()));
    expect_refused(by, text + ".", "three parts");
    expect_refused(by, text, "three parts");
    expect_refused(by, text + ".AAAA", "its algorithm is none of");
    expect_refused(by, rsa_key().jwt(header, claims()), "its algorithm is none of");
  }
  expect_refused(by, rsa_key().jwt(R"({"typ":"JWT"})", claims()), "its algorithm is none of");
  expect_refused(by, rsa_key().jwt(R"({"alg":256})", claims()), "its algorithm is none of");
}

TEST(JwtTest, APublicKeyIsNoSharedSecret) {
  const JwtVerifier by = verifier();
  for (const SigningKey* const key : all_keys())
    for (const char* const name : {"HS256", "HS384", "HS512", "RS256", "ES256", "EdDSA"}) {
      const std::string header = absl::StrCat(R"({"alg":")", name, R"("})");
      for (const std::string& secret : {key->pem(), key->jwk()})
        EXPECT_FALSE(by.verify(test::hmac_jwt(secret, header, claims()), kNow).ok()) << name;
    }
}

TEST(JwtTest, AnAlgorithmIsUsedOnlyWithAKeyOfItsType) {
  for (const SigningKey* const listed : all_keys())
    for (const SigningKey* const named : all_keys()) {
      const JwtVerifier by = *parsed(key_set({listed}));
      const bool accepted = by.verify(listed->jwt(header_of(*named), claims()), kNow).ok();
      EXPECT_EQ(accepted, listed == named) << listed->algorithm() << " " << named->algorithm();
    }
  for (const char* const other : {"RS384", "RS512", "PS256", "ES384", "ES256K", "ES512"})
    expect_refused(verifier(), rsa_key().jwt(absl::StrCat(R"({"alg":")", other, R"("})"), claims()), "its algorithm");
}

TEST(JwtTest, AnotherKeyOfTheSameTypeIsRefused) {
  const JwtVerifier by = verifier();
  const SigningKey others[] = {SigningKey::rsa(), SigningKey::p256(), SigningKey::ed25519()};
  for (const SigningKey& other : others)
    expect_refused(by, other.jwt(header_of(other), claims()), "its signature is wrong");
}

TEST(JwtTest, KeysInTheHeaderAreIgnored) {
  const SigningKey own = SigningKey::p256();
  const JwtVerifier by = verifier();
  for (const std::string& member :
       {absl::StrCat(R"(,"jwk":)", own.jwk()), std::string(R"(,"jku":"http://127.0.0.1:9/")"),
        std::string(R"(,"x5u":"http://127.0.0.1:9/")"), std::string(R"(,"x5c":["AAAA"])")})
    expect_refused(by, own.jwt(header_of(own, member), claims()), "its signature is wrong");
}

TEST(JwtTest, TheKidSelectsTheKey) {
  const SigningKey second = SigningKey::p256();
  const JwtVerifier by = *parsed(key_set({&ec_key(), &second}));
  EXPECT_TRUE(by.verify(ec_key().jwt(header_of(ec_key(), R"(,"kid":"k0")"), claims()), kNow).ok());
  EXPECT_TRUE(by.verify(second.jwt(header_of(second, R"(,"kid":"k1")"), claims()), kNow).ok());
  EXPECT_TRUE(by.verify(second.jwt(header_of(second), claims()), kNow).ok());
  expect_refused(by, second.jwt(header_of(second, R"(,"kid":"k0")"), claims()), "its signature is wrong");
  expect_refused(by, second.jwt(header_of(second, R"(,"kid":"k2")"), claims()), "there is no key");
  expect_refused(by, second.jwt(header_of(second, R"(,"kid":1)"), claims()), "kid is no string");
}

TEST(JwtTest, WithoutAKidFewKeysAreTried) {
  std::vector<SigningKey> keys;
  std::vector<const SigningKey*> pointers;
  for (int i = 0; i < 5; ++i) keys.push_back(SigningKey::p256());
  for (const SigningKey& key : keys) pointers.push_back(&key);
  const JwtVerifier by = *parsed(key_set(pointers));
  expect_refused(by, keys[0].jwt(header_of(keys[0]), claims()), "must have a kid");
  EXPECT_TRUE(by.verify(keys[4].jwt(header_of(keys[4], R"(,"kid":"k4")"), claims()), kNow).ok());
}

TEST(JwtTest, AFractionOfASecondDelaysTheEndOfTheIdentity) {
  const std::string exp = absl::StrCat(R"("exp":)", kNow + 100);
  const auto identity = verifier().verify(ec_key().jwt(header_of(ec_key()), claims_replaced(exp, exp + ".5")), kNow);
  ASSERT_TRUE(identity.ok());
  EXPECT_EQ((*identity)->expires, kNow + 101 + kJwtSkewSeconds);
}

TEST(JwtTest, TimesAreKeptWithASkewOfAMinute) {
  const JwtVerifier by = verifier();
  const std::string jwt = ec_key().jwt(header_of(ec_key()), claims());
  const int64_t expires = kNow + 100;
  EXPECT_TRUE(by.verify(jwt, expires + kJwtSkewSeconds - 1).ok());
  expect_refused(by, jwt, "it has expired", expires + kJwtSkewSeconds);
  expect_refused(by, jwt, "it has expired", expires + 1'000'000);
  const std::string later = ec_key().jwt(header_of(ec_key()), claims(absl::StrCat(R"(,"nbf":)", kNow + 60)));
  EXPECT_TRUE(by.verify(later, kNow).ok());
  expect_refused(by, later, "not valid yet", kNow - 1);
  const std::string issued = ec_key().jwt(header_of(ec_key()), claims(absl::StrCat(R"(,"iat":)", kNow + 60)));
  EXPECT_TRUE(by.verify(issued, kNow).ok());
  expect_refused(by, issued, "issued in the future", kNow - 1);
  EXPECT_TRUE(by.verify(ec_key().jwt(header_of(ec_key()), claims(absl::StrCat(R"(,"nbf":)", kNow, ".5"))), kNow).ok());
}

TEST(JwtTest, WrongClaimsAreRefused) {
  const JwtVerifier by = verifier();
  const std::string exp = absl::StrCat(R"("exp":)", kNow + 100);
  const std::vector<std::pair<std::string, const char*>> cases = {
      {claims_replaced(exp, R"("x":1)"), "no claim exp"},
      {claims_replaced(exp, R"("exp":"1800000000")"), "exp is no number"},
      {claims_replaced(exp, R"("exp":null)"), "exp is no number"},
      {claims_replaced(exp, R"("exp":1e300)"), "exp is no time"},
      {claims_replaced(exp, R"("exp":-1)"), "exp is no time"},
      {claims_replaced(exp, R"("exp":99999999999999999999)"), "no JSON object"},
      {claims(R"(,"nbf":"now")"), "nbf is no number"},
      {claims(R"(,"iat":[])"), "iat is no number"},
      {claims_replaced(R"("locus")", R"("other")"), "another audience"},
      {claims_replaced(R"("locus")", R"("locus2")"), "another audience"},
      {claims_replaced(R"("locus")", R"("")"), "another audience"},
      {claims_replaced(R"("locus")", R"(["a","b"])"), "another audience"},
      {claims_replaced(R"("locus")", R"([["locus"]])"), "another audience"},
      {claims_replaced(R"("locus")", R"({"locus":1})"), "another audience"},
      {claims_replaced(R"("aud")", R"("aux")"), "another audience"},
      {claims_replaced(R"("sub")", R"("sup")"), "claim sub"},
      {claims_replaced(R"("ann")", R"("")"), "claim sub"},
      {claims_replaced(R"("ann")", "7"), "claim sub"},
      {claims_replaced("ann", std::string(300, 'a')), "claim sub"},
      {claims_replaced("ann", R"(a\u0000b)"), "no JSON object"},
      {claims(R"(,"exp":9999999999)"), "no JSON object"},  // exp is given twice
      {"[]", "no JSON object"},
      {"", "three parts"},
      {"7", "no JSON object"},
      {claims() + "x", "no JSON object"},
  };
  for (const auto& [text, why] : cases) expect_refused(by, ec_key().jwt(header_of(ec_key()), text), why);
}

TEST(JwtTest, AListOfAudiencesAndTheIssuerAreChecked) {
  const JwtVerifier by = verifier(kIssuer);
  const std::string issuer = absl::StrCat(R"(,"iss":")", kIssuer, "\"");
  EXPECT_TRUE(by.verify(ed_key().jwt(header_of(ed_key()), claims(issuer)), kNow).ok());
  std::string list = claims(issuer);
  list = absl::StrReplaceAll(list, {{R"("locus")", R"(["other","locus"])"}});
  EXPECT_TRUE(by.verify(ed_key().jwt(header_of(ed_key()), list), kNow).ok());
  expect_refused(by, ed_key().jwt(header_of(ed_key()), claims()), "another issuer");
  expect_refused(by, ed_key().jwt(header_of(ed_key()), claims(R"(,"iss":"https://issuer.example.evil")")),
                 "another iss");
  expect_refused(by, ed_key().jwt(header_of(ed_key()), claims(R"(,"iss":7)")), "another issuer");
}

TEST(JwtTest, ExtensionsOfTheHeaderAreRefused) {
  const JwtVerifier by = verifier();
  for (const char* const member : {R"(,"crit":["exp"])", R"(,"zip":"DEF")", R"(,"b64":false)"})
    expect_refused(by, ed_key().jwt(header_of(ed_key(), member), claims()), "unsupported member");
  expect_refused(by, ed_key().jwt(header_of(ed_key(), R"(,"alg":"EdDSA")"), claims()), "no JSON object");
}

TEST(JwtTest, FormsThatAreNoCompactJwtAreRefused) {
  const JwtVerifier by = verifier();
  const std::string jwt = ed_key().jwt(header_of(ed_key()), claims());
  ASSERT_TRUE(by.verify(jwt, kNow).ok());
  for (const std::string& wrong :
       {std::string(), std::string("."), std::string(".."), jwt + ".", jwt + ".a", " " + jwt, jwt + " ", jwt + "=",
        jwt + "\n", absl::StrReplaceAll(jwt, {{"-", "+"}}) + "+", std::string("{\"payload\":\"a\"}")})
    expect_refused(by, wrong, "three parts");
  expect_refused(by, std::string(kMaxJwtBytes + 1, 'a'), "longer than");
  EXPECT_FALSE(by.verify(std::string(kMaxJwtBytes, '.'), kNow).ok());
  const std::string deep = test::base64url(std::string(2900, '['));
  expect_refused(by, absl::StrCat(deep, ".", deep, ".AAAA"), "header is no JSON object");
}

// A JWT that was changed or truncated is refused, unless it still decodes to the original.
TEST(JwtTest, ChangedJwtsAreNeverAccepted) {
  const JwtVerifier by = verifier();
  for (const SigningKey* const key : all_keys()) {
    const std::string jwt = key->jwt(header_of(*key), claims());
    for (uint64_t seed = 1; seed <= test::scaled_count(2000); ++seed) {
      test::Random random(seed);
      std::string changed = jwt;
      for (uint64_t i = 1 + random.below(3); i > 0; --i) {
        const uint64_t at = random.below(changed.size());
        if (random.chance(0.7)) changed[at] = static_cast<char>(random.below(256));
        if (random.chance(0.1)) changed.resize(at + 1);
        if (random.chance(0.1)) changed.insert(at, 1, random.pick(jwt));
      }
      // The last character of a part has unused bits; a change of only these bits does not change the JWT.
      if (!by.verify(changed, kNow).ok()) continue;
      EXPECT_EQ(changed.size(), jwt.size()) << "seed " << seed;
      EXPECT_EQ(changed.substr(0, changed.rfind('.')), jwt.substr(0, jwt.rfind('.'))) << "seed " << seed;
    }
  }
}

TEST(JwtTest, RandomBytesAreNeverAccepted) {
  const JwtVerifier by = verifier();
  for (uint64_t seed = 1; seed <= test::scaled_count(20000); ++seed) {
    test::Random random(seed);
    std::string bytes, payload;
    for (uint64_t i = random.below(200); i > 0; --i) bytes += static_cast<char>(random.below(256));
    for (uint64_t i = random.below(200); i > 0; --i) payload += random.pick(std::string("{}[]\":,0e-\\u\x01\xff"));
    EXPECT_FALSE(by.verify(bytes, kNow).ok()) << "seed " << seed;
    EXPECT_FALSE(by.verify(absl::StrCat(test::base64url(payload), ".", test::base64url(bytes), ".AAAA"), kNow).ok());
    EXPECT_FALSE(parsed(bytes).ok()) << "seed " << seed;
    EXPECT_FALSE(parsed(absl::StrCat(R"({"keys":[)", payload, "]}")).ok()) << "seed " << seed;
    if (seed % 100 == 0) {  // a valid signature of a random payload
      EXPECT_FALSE(by.verify(ed_key().jwt(header_of(ed_key()), payload), kNow).ok()) << "seed " << seed;
    }
  }
}

TEST(JwtTest, AKeySetNeedsAnAudience) {
  std::vector<std::string> warnings;
  const absl::Status status = JwtVerifier::parse("f", key_set({&ec_key()}), "", "", warnings).status();
  EXPECT_THAT(std::string(status.message()), HasSubstr("jwt_audience"));
}

TEST(JwtTest, KeySetsWithSecretsOrWrongKeysAreRefused) {
  const SigningKey weak = SigningKey::rsa(1024);
  const std::string ec = ec_key().jwk();
  const std::vector<std::pair<std::string, const char*>> cases = {
      {"", "array `keys`"},
      {"{}", "array `keys`"},
      {R"({"keys":{}})", "array `keys`"},
      {R"({"keys":[]})", "array `keys`"},
      {R"({"keys":[7]})", "no JSON object"},
      {R"({"keys":[{"kty":"oct","k":"c2VjcmV0"}]})", "secret"},
      {absl::StrCat(R"({"keys":[)", ec_key().jwk(R"(,"d":"AAAA")"), "]}"), "secret"},
      {absl::StrCat(R"({"keys":[)", weak.jwk(), "]}"), "it has 1024 bits"},
      {R"({"keys":[{"kty":"RSA","e":"AQAB"}]})", "missing or malformed"},
      {R"({"keys":[{"kty":"RSA","n":"!!","e":"AQAB"}]})", "keys[0]"},
      {R"({"keys":[{"kty":"EC","crv":"P-256","x":"AAAA","y":"AAAA"}]})", "keys[0]"},
      {R"({"keys":[{"kty":"OKP","crv":"Ed25519","x":"AAAA"}]})", "keys[0]"},
      {R"({"keys":[{"kty":"EC","crv":"P-384","x":"AAAA","y":"AAAA"}]})", "no key can verify"},
      {absl::StrCat(R"({"keys":[)", ec_key().jwk(R"(,"use":"enc")"), "]}"), "no key can verify"},
      {absl::StrCat(R"({"keys":[)", ec, "],\"keys\":[]}"), "array `keys`"},
  };
  for (const auto& [text, why] : cases) {
    const absl::Status status = parsed(text).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(status.message()), HasSubstr(why)) << text;
    EXPECT_THAT(std::string(status.message()), HasSubstr("keys.json")) << text;
  }
}

TEST(JwtTest, APointThatIsNotOnTheCurveIsRefused) {
  std::string x(32, '\x01'), y(32, '\x02');
  const std::string text = absl::StrCat(R"({"keys":[{"kty":"EC","crv":"P-256","x":")", test::base64url(x), R"(","y":")",
                                        test::base64url(y), R"("}]})");
  EXPECT_FALSE(parsed(text).ok());
}

TEST(JwtTest, KeysForOtherUsesAreSkippedWithAWarning) {
  std::vector<std::string> warnings;
  const std::string text = absl::StrCat(
      R"({"keys":[)", rsa_key().jwk(R"(,"use":"enc")"), ",", rsa_key().jwk(R"(,"alg":"PS256")"), ",",
      rsa_key().jwk(R"(,"key_ops":["sign"])"), R"(,{"kty":"new"},)",
      ec_key().jwk(R"(,"use":"sig","alg":"ES256","key_ops":["verify"],"x5u":"http://127.0.0.1:9/","x5c":["AAAA"])"),
      "]}");
  const absl::StatusOr<JwtVerifier> by = JwtVerifier::parse("f", text, kAudience, "", warnings);
  ASSERT_TRUE(by.ok()) << by.status();
  EXPECT_EQ(warnings.size(), 4u);
  EXPECT_TRUE(by->verify(ec_key().jwt(header_of(ec_key()), claims()), kNow).ok());
  expect_refused(*by, rsa_key().jwt(header_of(rsa_key()), claims()), "there is no key");
}

TEST(JwtTest, SubjectsWithWildcardsAndSpacesAreEscaped) {
  const JwtVerifier by = verifier();
  const std::string text = claims_replaced("ann", "a* b");
  EXPECT_EQ((*by.verify(ec_key().jwt(header_of(ec_key()), text), kNow))->principal, "jwt:a%2a%20b");
}

}  // namespace
}  // namespace locus::server
