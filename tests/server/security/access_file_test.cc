#include "server/security/access_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/refusal.h"
#include "server/security/security_limits.h"
#include "tests/support/random.h"
#include "tests/support/test_scale.h"

namespace locus::server {
namespace {

using testing::HasSubstr;

Identity identity(IdentityKind kind, const std::string& principal) {
  Identity made;
  made.kind = kind;
  made.principal = principal;
  return made;
}
Identity token(const std::string& id) { return identity(IdentityKind::kToken, "token:" + id); }

AccessRules rules(absl::string_view text) {
  absl::StatusOr<AccessRules> parsed = AccessRules::parse("access", text);
  EXPECT_TRUE(parsed.ok()) << parsed.status();
  return parsed.ok() ? *std::move(parsed) : AccessRules();
}

TEST(AccessFileTest, WhatNoLineGrantsIsRefused) {
  const AccessRules granted = rules("grant token:ci read arena-* lobby\n");
  EXPECT_TRUE(granted.allows(token("ci"), Right::kRead, "arena-1"));
  EXPECT_TRUE(granted.allows(token("ci"), Right::kRead, "lobby"));
  EXPECT_FALSE(granted.allows(token("ci"), Right::kRead, "lobby2"));
  EXPECT_FALSE(granted.allows(token("ci"), Right::kRead, "my-arena-1"));
  EXPECT_FALSE(granted.allows(token("ci"), Right::kUpdate, "lobby"));
  EXPECT_FALSE(granted.allows(token("ci2"), Right::kRead, "lobby"));
  EXPECT_FALSE(granted.allows(token("c"), Right::kRead, "lobby"));
  EXPECT_FALSE(granted.allows(Identity(), Right::kRead, "lobby"));
  for (const Right right : {Right::kMeshes, Right::kBackup, Right::kMetrics, Right::kReflection})
    EXPECT_FALSE(granted.allows(token("ci"), right));
}

TEST(AccessFileTest, RulesWithoutALineGrantNothing) {
  for (const AccessRules& none : {AccessRules(), rules(""), rules("# only a comment\n\n  # another\n")}) {
    EXPECT_FALSE(none.allows(Identity(), Right::kRead, "lobby"));
    EXPECT_FALSE(none.knows(Identity()));
    EXPECT_FALSE(none.has_quotas());
  }
}

TEST(AccessFileTest, AHigherRightToScenesIncludesTheLowerOnes) {
  const AccessRules granted = rules("grant token:a admin s\ngrant token:u update s\ngrant token:r read s\n");
  const std::vector<std::pair<std::string, int>> levels = {{"r", 0}, {"u", 1}, {"a", 2}};
  for (const auto& [id, level] : levels)
    for (const Right right : {Right::kRead, Right::kUpdate, Right::kAdmin})
      EXPECT_EQ(granted.allows(token(id), right, "s"), static_cast<int>(right) <= level) << id << right_name(right);
}

TEST(AccessFileTest, RightsToTheServerNeedNoSceneAndGiveNoneToScenes) {
  const AccessRules granted = rules("grant cert:ops meshes,backup\n");
  const Identity ops = identity(IdentityKind::kCertificate, "cert:ops");
  EXPECT_TRUE(granted.allows(ops, Right::kMeshes));
  EXPECT_TRUE(granted.allows(ops, Right::kBackup));
  EXPECT_FALSE(granted.allows(ops, Right::kMetrics));
  EXPECT_FALSE(granted.allows_any(ops, Right::kRead));
  EXPECT_TRUE(granted.knows(ops));
  EXPECT_FALSE(granted.knows(token("ops")));
}

TEST(AccessFileTest, PatternsOfPrincipalsMatchTheWholeText) {
  const AccessRules granted = rules("grant token:ci-? read *\ngrant *:ops backup\ngrant jwt:*@example.com metrics\n");
  EXPECT_TRUE(granted.allows(token("ci-7"), Right::kRead, "any"));
  EXPECT_FALSE(granted.allows(token("ci-77"), Right::kRead, "any"));
  EXPECT_TRUE(granted.allows(token("ops"), Right::kBackup));
  EXPECT_TRUE(granted.allows(identity(IdentityKind::kUser, "user:ops"), Right::kBackup));
  EXPECT_FALSE(granted.allows(token("ops2"), Right::kBackup));
  EXPECT_TRUE(granted.allows(identity(IdentityKind::kJwt, "jwt:a@example.com"), Right::kMetrics));
  EXPECT_FALSE(granted.allows(identity(IdentityKind::kJwt, "jwt:a@example.com.evil"), Right::kMetrics));
}

TEST(AccessFileTest, AllowsAnyAsksForAScenePattern) {
  const AccessRules granted = rules("grant token:ci update arena-*\n");
  EXPECT_TRUE(granted.allows_any(token("ci"), Right::kRead));
  EXPECT_TRUE(granted.allows_any(token("ci"), Right::kUpdate));
  EXPECT_FALSE(granted.allows_any(token("ci"), Right::kAdmin));
  EXPECT_FALSE(granted.allows_any(token("cj"), Right::kRead));
}

TEST(AccessFileTest, AnonymousHasOnlyWhatIsGrantedToIt) {
  const AccessRules granted = rules("grant anonymous read public-*\ngrant token:* admin *\n");
  EXPECT_TRUE(granted.allows(Identity(), Right::kRead, "public-1"));
  EXPECT_FALSE(granted.allows(Identity(), Right::kRead, "private"));
  EXPECT_FALSE(granted.allows(Identity(), Right::kUpdate, "public-1"));
}

TEST(AccessFileTest, TheLastQuotaThatMatchesCounts) {
  const AccessRules granted = rules(
      "quota token:* queries_per_s=50000 update_items_per_s=1e6 open_streams=16\n"
      "quota token:ci queries_per_s=10 burst_s=5\n"
      "quota token:ci queries_per_s=20\n"
      "quota token:big-* open_streams=unlimited\n"
      "quota connection:* open_streams=4\n");
  EXPECT_EQ(granted.quota_of(token("ci")).of(QuotaKind::kQueries), 20);
  EXPECT_EQ(granted.quota_of(token("ci")).of(QuotaKind::kUpdateItems), 1e6);
  EXPECT_EQ(granted.quota_of(token("ci")).burst_s, 5);
  EXPECT_EQ(granted.quota_of(token("other")).of(QuotaKind::kQueries), 50000);
  EXPECT_EQ(granted.quota_of(token("other")).burst_s, kDefaultBurstSeconds);
  EXPECT_EQ(granted.quota_of(token("big-1")).of(QuotaKind::kOpenStreams), kNoQuota);
  EXPECT_EQ(granted.quota_of(Identity()).of(QuotaKind::kQueries), kNoQuota);
  EXPECT_EQ(granted.quota_of("connection:ipv4:10.0.0.1:5").of(QuotaKind::kOpenStreams), 4);
  EXPECT_EQ(granted.quota_of("connection:ipv4:10.0.0.1:5").of(QuotaKind::kQueries), kNoQuota);
}

TEST(AccessFileTest, AQuotaOfEveryCallerIsNoneOfConnections) {
  const AccessRules granted = rules("quota * open_streams=16\n");
  EXPECT_EQ(granted.quota_of(Identity()).of(QuotaKind::kOpenStreams), 16);
  EXPECT_EQ(granted.quota_of("connection:x").of(QuotaKind::kOpenStreams), kNoQuota);
}

TEST(AccessFileTest, CommentsSpacesAndCarriageReturnsAreSkipped) {
  const AccessRules granted =
      rules("  grant\ttoken:ci   read lobby # and no more: arena\r\n#grant token:* admin *\r\n");
  EXPECT_TRUE(granted.allows(token("ci"), Right::kRead, "lobby"));
  EXPECT_FALSE(granted.allows(token("ci"), Right::kRead, "arena"));
  EXPECT_FALSE(granted.allows(token("ci"), Right::kUpdate, "lobby"));
}

struct Mistake {
  const char* line;
  const char* text;
};

TEST(AccessFileTest, AMistakeIsRefusedWithItsLineAndWhatToWrite) {
  const Mistake mistakes[] = {
      {"allow token:ci read *", "begins with `grant` or `quota`"},
      {"Grant token:ci read *", "begins with `grant` or `quota`"},
      {"grant", "write `grant PRINCIPAL"},
      {"grant token:ci", "write `grant PRINCIPAL"},
      {"grant token:ci read", "write * for all scenes"},
      {"grant token:ci read # *", "write * for all scenes"},
      {"grant token:ci write *", "there is no right `write`"},
      {"grant token:ci read,,update *", "there is no right ``"},
      {"grant token:ci read, update *", "there is no right ``"},
      {"grant token:ci READ *", "the rights are read, update"},
      {"grant token:ci meshes *", "remove `*`"},
      {"grant tokn:ci read *", "no caller is named `tokn:ci`"},
      {"grant ci read *", "cert:NAME, token:ID"},
      {"grant anonymouse read *", "no caller is named"},
      {"grant token: read *", "no caller is named"},
      {"grant x* read *", "no caller is named"},
      {"grant connection:* read *", "no caller is named"},
      {"grant token:\xc3\xa9 read *", "printable ASCII"},
      {"grant token:ci read Arena", "a-z, 0-9, -, _"},
      {"grant token:ci read arena/1", "a-z, 0-9, -, _"},
      {"grant token:ci read [a-z]", "a-z, 0-9, -, _"},
      {"quota token:ci", "write `quota PRINCIPAL"},
      {"quota token:ci queries=5", "there is no quota `queries`"},
      {"quota token:ci queries_per_s", "must be a number"},
      {"quota token:ci queries_per_s=", "must be a number"},
      {"quota token:ci queries_per_s=-1", "must be a number"},
      {"quota token:ci queries_per_s=nan", "must be a number"},
      {"quota token:ci queries_per_s=inf", "unlimited"},
      {"quota token:ci queries_per_s=1e300", "must be a number"},
      {"quota token:ci queries_per_s=5x", "must be a number"},
      {"quota token:ci queries_per_s=5=6", "must be a number"},
      {"quota token:ci queries_per_s=5 queries_per_s=6", "given twice"},
      {"quota token:ci burst_s=0", "above 0"},
      {"quota token:ci burst_s=unlimited", "above 0"},
      {"quota token:ci burst_s=1 burst_s=2", "given twice"},
      {"quota connection: open_streams=1", "no caller is named"},
      {"quota connection:* objects=1", "a connection has no quota objects"},
      {"quota connection:* scenes=1", "a connection has no quota scenes"},
      {"quota connection:* mesh_bytes=1", "a connection has no quota mesh_bytes"},
      {"quota connection:* history_bytes=1", "write it for a principal"},
  };
  for (const Mistake& mistake : mistakes) {
    const std::string text = absl::StrCat("# first\ngrant anonymous read *\n", mistake.line, "\n");
    const absl::Status status = AccessRules::parse("rules.access", text).status();
    ASSERT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << mistake.line;
    EXPECT_THAT(std::string(status.message()), HasSubstr("rules.access:3: ")) << mistake.line;
    EXPECT_THAT(std::string(status.message()), HasSubstr(mistake.text)) << mistake.line;
    EXPECT_EQ(refusal_of(status)->reason, Reason::kMalformed);
  }
}

TEST(AccessFileTest, FilesAndLinesBeyondTheLimitsAreRefused) {
  const std::string line = "grant token:ci read *\n";
  std::string lines;
  for (size_t i = 0; i < kMaxAccessLines + 1; ++i) lines += line;
  EXPECT_FALSE(AccessRules::parse("f", lines).ok());
  EXPECT_FALSE(AccessRules::parse("f", std::string(kMaxSecurityFileBytes + 1, '\n')).ok());
  EXPECT_FALSE(AccessRules::parse("f", absl::StrCat("grant token:", std::string(300, 'a'), " read *")).ok());
  EXPECT_FALSE(AccessRules::parse("f", absl::StrCat("grant token:ci read ", std::string(300, 'a'))).ok());
  std::string patterns = "grant token:ci read";
  for (size_t i = 0; i < kMaxScenePatterns; ++i) patterns += " a";
  EXPECT_TRUE(AccessRules::parse("f", patterns).ok());
  EXPECT_FALSE(AccessRules::parse("f", patterns + " a").ok());
}

TEST(AccessFileTest, AnErrorRepeatsNoControlCharacterAndNoLongWord) {
  const absl::Status status = AccessRules::parse("f", absl::StrCat("\x1b[31m\x07", std::string(9999, 'x'))).status();
  EXPECT_LT(status.message().size(), 400u);
  for (const char c : status.message()) EXPECT_TRUE(c >= ' ' && c < 0x7f);
}

TEST(AccessFileTest, WithoutAnAccessFileEverybodyOrEveryVerifiedCallerMayDoEverything) {
  const AccessRules all = AccessRules::all_allowed(), verified = AccessRules::verified_allowed();
  for (size_t i = 0; i < kRights; ++i) {
    const auto right = static_cast<Right>(i);
    EXPECT_TRUE(all.allows(Identity(), right, "lobby"));
    EXPECT_FALSE(verified.allows(Identity(), right, "lobby"));
    EXPECT_FALSE(verified.allows(identity(IdentityKind::kUser, "user:root"), right, "lobby"));
    EXPECT_TRUE(verified.allows(token("x"), right, "lobby"));
    EXPECT_TRUE(verified.allows(identity(IdentityKind::kJwt, "jwt:x"), right, "lobby"));
  }
}

// Random bytes are accepted only if they are blank. Random sequences of the words that access files use cause no crash,
// and an accepted text grants nothing to callers that no line names.
TEST(AccessFileTest, RandomTextsNeverCrashAndGrantNothingToOthers) {
  const std::vector<std::string> words = {"grant",
                                          "quota",
                                          "token:ci",
                                          "token:*",
                                          "cert:?",
                                          "read",
                                          "update,admin",
                                          "meshes",
                                          "*",
                                          "arena-*",
                                          "#",
                                          "\n",
                                          "\n",
                                          "queries_per_s=5",
                                          "burst_s=1",
                                          "=",
                                          "\t",
                                          "\r",
                                          ",",
                                          std::string(1, '\0')};
  for (uint64_t seed = 1; seed <= test::scaled_count(20000); ++seed) {
    test::Random random(seed);
    std::string bytes, language;
    for (uint64_t i = random.below(60); i > 0; --i) bytes += static_cast<char>(random.below(256));
    for (uint64_t i = random.below(30); i > 0; --i) absl::StrAppend(&language, random.pick(words), " ");
    const bool accepted = AccessRules::parse("f", "x" + bytes).ok();
    EXPECT_FALSE(accepted) << "seed " << seed;
    const absl::StatusOr<AccessRules> parsed = AccessRules::parse("f", language);
    if (!parsed.ok()) {
      EXPECT_EQ(parsed.status().code(), absl::StatusCode::kInvalidArgument) << "seed " << seed;
    } else {
      EXPECT_FALSE(parsed->allows(identity(IdentityKind::kUser, "user:x"), Right::kRead, "arena-1")) << "seed " << seed;
    }
  }
}

}  // namespace
}  // namespace locus::server
