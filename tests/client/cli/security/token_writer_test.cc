#include "client/cli/security/token_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client/cli/security/private_file.h"
#include "tests/support/sha256_hex.h"
#include "tests/support/temporary_folder.h"

namespace locus::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::Not;

const absl::Time kNoon = absl::FromUnixSeconds(1716984000);  // 2024-05-29T12:00:00Z

class TokenWriterTest : public ::testing::Test {
 protected:
  absl::StatusOr<std::string> create(absl::string_view id, std::optional<absl::Duration> lifetime = std::nullopt,
                                     absl::string_view comment = "") {
    return create_token(file_, id, kNoon, lifetime, comment);
  }
  std::string text() const { return read_security_file(file_)->text; }

  const test::TemporaryFolder folder_;
  const std::string file_ = folder_.file("tokens");
};

TEST_F(TokenWriterTest, TheFileHasTheHashOfTheTokenAndNotTheToken) {
  const auto token = create("lobby", absl::Hours(24), "first floor");
  ASSERT_TRUE(token.ok()) << token.status();
  EXPECT_THAT(*token, MatchesRegex("locus_lobby_[A-Za-z0-9_-]+"));
  EXPECT_EQ(token->size(), strlen("locus_lobby_") + 43);
  EXPECT_EQ(text(), absl::StrCat("lobby ", test::sha256_hex(*token),
                                 " 2024-05-29T12:00:00Z 2024-05-30T12:00:00Z first floor\n"));
  struct stat status {};
  ASSERT_EQ(::stat(file_.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777, 0600u);
}

TEST_F(TokenWriterTest, TokensOfOneIdDiffer) {
  const auto first = create("lobby");
  ASSERT_TRUE(revoke_token(file_, "lobby").ok());
  const auto second = create("lobby");
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_NE(*first, *second);
}

TEST_F(TokenWriterTest, CommentsOfTheFileAndItsModeStay) {
  std::ofstream(file_) << "# ours";  // without a final newline
  ASSERT_EQ(::chmod(file_.c_str(), 0640), 0);
  ASSERT_TRUE(create("a").ok());
  ASSERT_TRUE(create("b").ok());
  ASSERT_TRUE(revoke_token(file_, "a").ok());
  EXPECT_THAT(text(), MatchesRegex("# ours\nb [0-9a-f]+ 2024-05-29T12:00:00Z never\n"));
  EXPECT_EQ(read_security_file(file_)->mode, 0640u);
}

TEST_F(TokenWriterTest, AnIdIsListedOnlyOnceAndHasTheFormThatLocusdReads) {
  ASSERT_TRUE(create("lobby").ok());
  EXPECT_TRUE(absl::IsAlreadyExists(create("lobby").status()));
  for (const char* id : {"", "-a", "a-", "A", "a_b", "a b"})
    EXPECT_EQ(create(id).status().code(), absl::StatusCode::kInvalidArgument) << id;
  EXPECT_TRUE(create(std::string(kMaxTokenId, 'x')).ok());
  EXPECT_FALSE(create(std::string(kMaxTokenId + 1, 'x')).ok());
  EXPECT_FALSE(create("c", std::nullopt, "two\nlines").ok());
}

TEST_F(TokenWriterTest, AFileThatLocusdWouldRefuseIsNotChanged) {
  std::ofstream(file_) << "locus_secret_in_the_wrong_place\n";
  ASSERT_EQ(::chmod(file_.c_str(), 0600), 0);
  const absl::Status malformed = create("a").status();
  EXPECT_THAT(std::string(malformed.message()), HasSubstr(":1: "));
  EXPECT_THAT(std::string(malformed.message()), Not(HasSubstr("secret")));
  std::ofstream(file_).flush();
  ASSERT_EQ(::chmod(file_.c_str(), 0620), 0);
  EXPECT_THAT(std::string(create("a").status().message()), HasSubstr("chmod go-w"));
}

TEST_F(TokenWriterTest, TokensAreListedWithTheirStateAndRevokedById) {
  ASSERT_TRUE(create("short", absl::Hours(1)).ok());
  ASSERT_TRUE(create("long").ok());
  const auto before = list_tokens(file_, kNoon + absl::Hours(1) - absl::Seconds(1));
  const auto after = list_tokens(file_, kNoon + absl::Hours(1));
  ASSERT_TRUE(before.ok() && after.ok());
  ASSERT_EQ(after->size(), 2u);
  EXPECT_FALSE((*before)[0].expired);
  EXPECT_TRUE((*after)[0].expired);
  EXPECT_EQ((*after)[1].expires, "never");
  EXPECT_FALSE((*after)[1].expired);
  EXPECT_TRUE(absl::IsNotFound(revoke_token(file_, "lon")));
  ASSERT_TRUE(revoke_token(file_, "short").ok());
  EXPECT_EQ(list_tokens(file_, kNoon)->size(), 1u);
}

TEST_F(TokenWriterTest, WritersAtTheSameTimeLoseNoToken) {
  constexpr int kEach = 20;
  const auto write = [this](const std::string& name) {
    for (int i = 0; i < kEach; ++i) EXPECT_TRUE(create(absl::StrCat(name, i)).ok());
  };
  std::thread other([&] { write("b"); });
  write("a");
  other.join();
  EXPECT_EQ(list_tokens(file_, kNoon)->size(), size_t{2} * kEach);
}

TEST(LifetimeTest, HoursDaysAndWeeksUpTo100Years) {
  EXPECT_EQ(*parse_lifetime("12h"), absl::Hours(12));
  EXPECT_EQ(*parse_lifetime("30d"), absl::Hours(720));
  EXPECT_EQ(*parse_lifetime("2w"), absl::Hours(336));
  EXPECT_TRUE(parse_lifetime("36500d").ok());
  for (const char* text : {"", "d", "0d", "-1d", "+1d", "1", "1m", "1.5d", " 1d", "36501d", "99999999999999999999d"})
    EXPECT_FALSE(parse_lifetime(text).ok()) << text;
}

}  // namespace
}  // namespace locus::cli
