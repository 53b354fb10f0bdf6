#include "server/security/identity.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "server/security/security_limits.h"
#include "tests/support/random.h"
#include "tests/support/test_scale.h"

namespace locus::server {
namespace {

TEST(IdentityTest, APrincipalIsItsKindAndName) {
  EXPECT_EQ(*principal_of(IdentityKind::kCertificate, "spiffe://example.com/ops"), "cert:spiffe://example.com/ops");
  EXPECT_EQ(*principal_of(IdentityKind::kToken, "ci"), "token:ci");
  EXPECT_EQ(*principal_of(IdentityKind::kJwt, "ann@example.com"), "jwt:ann@example.com");
  EXPECT_EQ(*principal_of(IdentityKind::kUser, "daemon"), "user:daemon");
  EXPECT_EQ(anonymous_identity()->principal, "anonymous");
}

TEST(IdentityTest, WhatAnAccessFileCannotNameIsEscaped) {
  EXPECT_EQ(*principal_of(IdentityKind::kCertificate, "Ops Team"), "cert:Ops%20Team");
  EXPECT_EQ(*principal_of(IdentityKind::kCertificate, "*.example.com"), "cert:%2a.example.com");
  EXPECT_EQ(*principal_of(IdentityKind::kCertificate, std::string("a\0b\n", 4)), "cert:a%00b%0a");
  EXPECT_EQ(*principal_of(IdentityKind::kCertificate, "a%20b"), "cert:a%2520b");
}

TEST(IdentityTest, EmptyAndLongNamesAreRefused) {
  EXPECT_FALSE(principal_of(IdentityKind::kJwt, "").ok());
  EXPECT_TRUE(principal_of(IdentityKind::kJwt, std::string(kMaxPrincipalBytes - 4, 'a')).ok());
  EXPECT_FALSE(principal_of(IdentityKind::kJwt, std::string(kMaxPrincipalBytes - 3, 'a')).ok());
  EXPECT_FALSE(principal_of(IdentityKind::kJwt, std::string(kMaxPrincipalBytes / 2, ' ')).ok());
}

TEST(IdentityTest, DifferentNamesHaveDifferentPrincipals) {
  std::set<std::string> names, principals;
  test::Random random(1);
  for (uint64_t i = 0; i < test::scaled_count(20000); ++i) {
    std::string name;
    for (uint64_t length = 1 + random.below(4); length > 0; --length) name += random.pick(std::string("a%20* ?2f\n"));
    if (!names.insert(name).second) continue;
    EXPECT_TRUE(principals.insert(*principal_of(IdentityKind::kUser, name)).second) << name;
  }
}

}  // namespace
}  // namespace locus::server
