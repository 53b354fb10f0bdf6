#include "server/security/audit_line.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <jansson.h>

#include <string>

#include "server/security/json_value.h"
#include "server/security/security_limits.h"
#include "tests/support/random.h"
#include "tests/support/test_scale.h"

namespace locus::server {
namespace {

TEST(AuditLineTest, ALineHasAllMembers) {
  AuditEntry entry;
  entry.unix_ms = 1'700'000'000'123;
  entry.principal = "token:ci";
  entry.peer = "ipv4:10.0.0.1:5";
  entry.rpc = "/locus.v1.SceneService/DeleteScene";
  entry.subject = "lobby";
  entry.code = absl::StatusCode::kPermissionDenied;
  entry.request_id = "r1";
  entry.text = "needs admin";
  EXPECT_EQ(audit_line(entry),
            "{\"time\":\"2023-11-14T22:13:20.123Z\",\"principal\":\"token:ci\",\"peer\":\"ipv4:10.0.0.1:5\","
            "\"rpc\":\"/locus.v1.SceneService/DeleteScene\",\"subject\":\"lobby\",\"code\":\"PERMISSION_DENIED\","
            "\"request_id\":\"r1\",\"text\":\"needs admin\"}\n");
}

TEST(AuditLineTest, WhatIsNotPlainIsEscaped) {
  EXPECT_EQ(json_string("a\"b\\c"), "\"a\\\"b\\\\c\"");
  EXPECT_EQ(json_string(std::string("\n\0\x1b\x7f", 4)), "\"\\u000a\\u0000\\u001b\\u007f\"");
  EXPECT_EQ(json_string("\xc3\xa9"), "\"\\u00e9\"");
  EXPECT_EQ(json_string("\xf0\x9f\x98\x80"), "\"\\ud83d\\ude00\"");
}

TEST(AuditLineTest, BytesThatAreNoUtf8BecomeTheReplacementCharacter) {
  for (const char* const wrong :
       {"\x80", "\xc3", "\xc0\x80", "\xe0\x80\x80", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xff"}) {
    const std::string text = json_string(wrong);
    EXPECT_THAT(text, testing::StartsWith("\"\\ufffd"));
    EXPECT_THAT(json_string(std::string(wrong) + "a"), testing::EndsWith("a\""));
  }
}

TEST(AuditLineTest, LongTextsAreCut) {
  AuditEntry entry;
  entry.text = std::string(5000, 'a');
  EXPECT_LT(audit_line(entry).size(), kMaxAuditTextBytes + 300);
}

// Every entry becomes one line of ASCII that a JSON parser accepts. Valid UTF-8 is read back unchanged.
TEST(AuditLineTest, RandomTextsAreReadBackByAParser) {
  const std::string pieces[] = {"a", "\"", "\\", "\n", "\xc3\xa9", "\xe2\x82\xac", "\xf0\x9f\x98\x80", "\x7f", "\x01"};
  for (uint64_t seed = 1; seed <= test::scaled_count(20000); ++seed) {
    test::Random random(seed);
    AuditEntry entry;
    for (uint64_t i = random.below(50); i > 0; --i) entry.text += random.pick(pieces);
    for (uint64_t i = random.below(50); i > 0; --i) entry.principal += static_cast<char>(random.below(256));
    const std::string line = audit_line(entry);
    ASSERT_EQ(line.find('\n'), line.size() - 1) << "seed " << seed;
    for (const char c : line.substr(0, line.size() - 1)) ASSERT_TRUE(c >= ' ' && c < 0x7f) << "seed " << seed;
    const JsonPointer parsed(json_loadb(line.data(), line.size(), JSON_ALLOW_NUL | JSON_REJECT_DUPLICATES, nullptr));
    ASSERT_TRUE(json_is_object(parsed.get())) << "seed " << seed << " " << line;
    ASSERT_EQ(json_text(json_object_get(parsed.get(), "text")), entry.text) << "seed " << seed;
  }
}

}  // namespace
}  // namespace locus::server
