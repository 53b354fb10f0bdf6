#include "server/security/token_file.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <set>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "server/security/security_limits.h"
#include "server/security/text_file.h"
#include "tests/support/random.h"
#include "tests/support/sha256_hex.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_scale.h"

namespace locus::server {
namespace {

using testing::HasSubstr;

constexpr int64_t kNow = 1'700'000'000;
const std::string kSecret(43, 'a');

// Returns the line of a token whose secret is kSecret.
std::string line(const std::string& id, const std::string& expires = "never") {
  return absl::StrCat(id, " ", test::sha256_hex(absl::StrCat("locus_", id, "_", kSecret)), " 2023-01-01 ", expires,
                      " made here\n");
}

TokenTable table(const std::string& text) {
  absl::StatusOr<TokenTable> parsed = TokenTable::parse("tokens", text);
  EXPECT_TRUE(parsed.ok()) << parsed.status();
  return parsed.ok() ? *std::move(parsed) : TokenTable();
}

class TokenFileTest : public testing::Test {
 protected:
  TokenTable read() {
    std::vector<std::string> warnings;
    absl::StatusOr<TokenTable> read = TokenTable::read(file_, warnings);
    EXPECT_TRUE(read.ok()) << read.status();
    return read.ok() ? *std::move(read) : TokenTable();
  }
  mode_t mode() {
    struct stat status;
    EXPECT_EQ(stat(file_.c_str(), &status), 0);
    return status.st_mode & 07777;
  }
  std::string text() { return read_text_file(file_)->text; }

  test::TemporaryFolder folder_;
  const std::string file_ = folder_.file("tokens");
};

TEST_F(TokenFileTest, OnlyTheWholeTokenIsFound) {
  const TokenTable tokens = table("# comment\n\n" + line("ci") + line("ci-2"));
  const std::string token = "locus_ci_" + kSecret;
  ASSERT_NE(tokens.find(token, kNow), nullptr);
  EXPECT_EQ(tokens.find(token, kNow)->id, "ci");
  EXPECT_EQ(tokens.find(token, kNow)->comment, "made here");
  for (size_t length = 0; length < token.size(); ++length)
    EXPECT_EQ(tokens.find(token.substr(0, length), kNow), nullptr) << length;
  for (size_t at = 0; at < token.size(); ++at) {
    std::string changed = token;
    changed[at] = changed[at] == 'b' ? 'c' : 'b';
    EXPECT_EQ(tokens.find(changed, kNow), nullptr) << at;
  }
  for (const std::string& other : {token + "a", token + " ", " " + token, "locus_ci-2_" + std::string(43, 'b'),
                                   "locus_unknown_" + kSecret, "locus__" + kSecret, "LOCUS_ci_" + kSecret})
    EXPECT_EQ(tokens.find(other, kNow), nullptr) << other;
}

TEST_F(TokenFileTest, AHashThatAgreesOnlyAtItsBeginningIsRefused) {
  const std::string token = "locus_ci_" + kSecret;
  for (size_t at = 1; at < 64; ++at) {
    std::string hash = test::sha256_hex(token);
    hash[at] = hash[at] == '0' ? '1' : '0';
    EXPECT_EQ(table("ci " + hash + " 2023-01-01 never\n").find(token, kNow), nullptr) << at;
  }
}

TEST_F(TokenFileTest, AnUnknownIdIsNoTokenOfTheZeroHash) {
  EXPECT_EQ(TokenTable().find("locus_ci_" + kSecret, kNow), nullptr);
}

TEST_F(TokenFileTest, ATokenEndsInTheSecondThatTheFileSays) {
  const TokenTable tokens = table(line("a", "2023-11-14T22:13:20Z") + line("b", "2023-11-15"));
  const std::string a = "locus_a_" + kSecret, b = "locus_b_" + kSecret;
  EXPECT_NE(tokens.find(a, kNow - 1), nullptr);  // kNow is 2023-11-14T22:13:20Z
  EXPECT_EQ(tokens.find(a, kNow), nullptr);
  EXPECT_NE(tokens.find(b, kNow), nullptr);
  EXPECT_EQ(tokens.find(b, kNow + 86400), nullptr);
  const TokenHash hash = tokens.entries()[0].hash;
  const absl::string_view bytes(reinterpret_cast<const char*>(hash.data()), hash.size());
  EXPECT_TRUE(tokens.contains("a", bytes, kNow - 1));
  EXPECT_FALSE(tokens.contains("a", bytes, kNow));
  EXPECT_FALSE(tokens.contains("b", bytes, kNow));
  EXPECT_FALSE(tokens.contains("c", bytes, kNow - 1));
}

TEST_F(TokenFileTest, AMistakeIsRefusedWithItsLineAndWhatToWrite) {
  const std::string hash(64, '0');
  const std::vector<std::pair<std::string, const char*>> mistakes = {
      {"ci", "write `ID SHA256-HEX"},
      {"ci " + hash + " 2023-01-01", "write `ID SHA256-HEX"},
      {" ci " + hash + " 2023-01-01 never", "an id has"},
      {"CI " + hash + " 2023-01-01 never", "an id has"},
      {"c_i " + hash + " 2023-01-01 never", "an id has"},
      {"-ci " + hash + " 2023-01-01 never", "an id has"},
      {std::string(64, 'a') + " " + hash + " 2023-01-01 never", "an id has"},
      {"ci locus_ci_" + kSecret + " 2023-01-01 never", "never the token"},
      {"ci " + std::string(63, '0') + " 2023-01-01 never", "64 of 0-9 and a-f"},
      {"ci " + std::string(64, 'A') + " 2023-01-01 never", "64 of 0-9 and a-f"},
      {"ci " + hash + " yesterday never", "write CREATED"},
      {"ci " + hash + " 2023-01-01 soon", "write EXPIRES"},
      {"ci " + hash + " 2023-01-01 Never", "write EXPIRES"},
      {"ci " + hash + " 2023-02-30 never", "write CREATED"},
      {"ci " + hash + " 2023-01-01 2023-1-1", "write EXPIRES"},
      {"ci " + hash + " 2023-01-01 2023-01-01T24:00:00Z", "write EXPIRES"},
      {"ci " + hash + " 2023-01-01 infinite-future", "write EXPIRES"},
      {"ok " + hash + " 2023-01-01 never", "listed twice"},
  };
  for (const auto& [text, why] : mistakes) {
    const absl::Status status = TokenTable::parse("tokens", line("ok") + text + "\n").status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(status.message()), HasSubstr("tokens:2: ")) << text;
    EXPECT_THAT(std::string(status.message()), HasSubstr(why)) << text;
    EXPECT_THAT(std::string(status.message()), testing::Not(HasSubstr(kSecret))) << "an error repeats a token";
  }
}

TEST_F(TokenFileTest, AnAddedTokenIsFoundUntilItIsRevoked) {
  const std::string token = *add_token(file_, "ci", kNow, kNow + 10, "for the build");
  const std::string other = *add_token(file_, "ops", kNow, std::nullopt, "");
  EXPECT_TRUE(is_token(token));
  EXPECT_EQ(token.size(), std::string("locus_ci_").size() + 43);
  EXPECT_EQ(mode(), 0600u);
  EXPECT_THAT(text(), testing::Not(HasSubstr(token.substr(9))));
  const TokenTable tokens = read();
  ASSERT_NE(tokens.find(token, kNow), nullptr);
  EXPECT_EQ(tokens.find(token, kNow)->comment, "for the build");
  EXPECT_EQ(tokens.find(token, kNow)->created, kNow);
  EXPECT_EQ(tokens.find(token, kNow + 10), nullptr);
  EXPECT_NE(tokens.find(other, kNow + 1'000'000'000), nullptr);
  ASSERT_TRUE(revoke_token(file_, "ci").ok());
  EXPECT_EQ(read().find(token, kNow), nullptr);
  EXPECT_NE(read().find(other, kNow), nullptr);
  EXPECT_EQ(revoke_token(file_, "ci").code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(mode(), 0600u);
}

TEST_F(TokenFileTest, ChangesKeepCommentsAndTheMode) {
  ASSERT_TRUE(replace_text_file(file_, "# ours\n" + line("ci") + "# end", 0640).ok());
  ASSERT_TRUE(add_token(file_, "ops", kNow, std::nullopt, "").ok());
  EXPECT_THAT(text(), HasSubstr("# ours\n" + line("ci") + "# end\nops "));
  EXPECT_EQ(mode(), 0640u);
  ASSERT_TRUE(revoke_token(file_, "ops").ok());
  EXPECT_EQ(text(), "# ours\n" + line("ci") + "# end\n");
  EXPECT_EQ(mode(), 0640u);
}

TEST_F(TokenFileTest, WhatCannotBeReadBackIsNotWritten) {
  ASSERT_TRUE(add_token(file_, "ci", kNow, std::nullopt, "").ok());
  const std::string before = text();
  EXPECT_EQ(add_token(file_, "ci", kNow, std::nullopt, "").status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(add_token(file_, "C I", kNow, std::nullopt, "").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(add_token(file_, "", kNow, std::nullopt, "").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_FALSE(add_token(file_, "ops", kNow, std::nullopt, "two\nlines").ok());
  EXPECT_EQ(text(), before);
  ASSERT_TRUE(replace_text_file(file_, "mistake\n", 0600).ok());
  EXPECT_FALSE(add_token(file_, "ops", kNow, std::nullopt, "").ok());
  EXPECT_FALSE(revoke_token(file_, "ci").ok());
  EXPECT_EQ(text(), "mistake\n");
}

TEST_F(TokenFileTest, NewTokensDiffer) {
  std::set<std::string> tokens;
  for (int i = 0; i < 1000; ++i) EXPECT_TRUE(tokens.insert(new_token("ci")).second);
}

TEST_F(TokenFileTest, FilesThatOthersCanWriteAreRefusedAndReadableOnesWarnedOf) {
  ASSERT_TRUE(replace_text_file(file_, line("ci"), 0600).ok());
  std::vector<std::string> warnings;
  EXPECT_TRUE(TokenTable::read(file_, warnings).ok());
  EXPECT_TRUE(warnings.empty());
  ASSERT_EQ(chmod(file_.c_str(), 0640), 0);
  EXPECT_TRUE(TokenTable::read(file_, warnings).ok());
  EXPECT_TRUE(warnings.empty());
  ASSERT_EQ(chmod(file_.c_str(), 0644), 0);
  EXPECT_TRUE(TokenTable::read(file_, warnings).ok());
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0], HasSubstr("chmod o-r"));
  for (const mode_t wrong : {0620, 0602, 0666}) {
    ASSERT_EQ(chmod(file_.c_str(), wrong), 0);
    EXPECT_EQ(TokenTable::read(file_, warnings).status().code(), absl::StatusCode::kFailedPrecondition) << wrong;
  }
}

TEST_F(TokenFileTest, WritersAtTheSameTimeLoseNoToken) {
  constexpr int kThreads = 4, kTokens = 10;
  std::vector<std::thread> threads;
  for (int t = 0; t < kThreads; ++t)
    threads.emplace_back([&, t] {
      for (int i = 0; i < kTokens; ++i) {
        const std::string id = absl::StrCat("t", t, "-", i);
        EXPECT_TRUE(add_token(file_, id, kNow, std::nullopt, "").ok());
        if (i % 2 == 0) continue;
        EXPECT_TRUE(revoke_token(file_, id).ok());
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(read().entries().size(), size_t{kThreads * kTokens / 2});
}

TEST_F(TokenFileTest, RandomBytesNeverCrashAndAreNeverAccepted) {
  const TokenTable tokens = table(line("ci"));
  for (uint64_t seed = 1; seed <= test::scaled_count(20000); ++seed) {
    test::Random random(seed);
    std::string bytes, changed = line("ci");
    for (uint64_t i = random.below(100); i > 0; --i) bytes += static_cast<char>(random.below(256));
    const uint64_t at = random.below(66);  // position in the id and the hash, not counting the space between them
    changed[at < 2 ? at : at + 1] = static_cast<char>(random.below(256));
    EXPECT_FALSE(TokenTable::parse("f", "x" + bytes).ok()) << "seed " << seed;
    EXPECT_EQ(tokens.find("locus_ci_" + bytes, kNow), nullptr) << "seed " << seed;
    EXPECT_EQ(tokens.find(bytes, kNow), nullptr) << "seed " << seed;
    const absl::StatusOr<TokenTable> parsed = TokenTable::parse("f", changed);
    if (parsed.ok() && changed != line("ci")) {
      EXPECT_EQ(parsed->find("locus_ci_" + kSecret, kNow), nullptr) << "seed " << seed;
    }
  }
}

TEST_F(TokenFileTest, FilesBeyondTheLimitsAreRefused) {
  std::string comments;
  for (size_t i = 0; i < kMaxTokens; ++i) comments += "#\n";
  EXPECT_FALSE(TokenTable::parse("f", comments + line("ci")).ok());
  EXPECT_FALSE(TokenTable::parse("f", absl::StrCat("#", std::string(kMaxSecurityFileBytes, 'a'))).ok());
}

}  // namespace
}  // namespace locus::server
