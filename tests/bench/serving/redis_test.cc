#include "tests/bench/serving/redis.h"

#include <gtest/gtest.h>

#include <filesystem>

namespace locus::bench::serving {
namespace {

TEST(RedisTest, ACommandIsAListOfStrings) {
  EXPECT_EQ(redis_command({"GEOADD", "key"}), "*2\r\n$6\r\nGEOADD\r\n$3\r\nkey\r\n");
}

TEST(RedisTest, ANumberAnErrorAndAWordAreALineEach) {
  EXPECT_EQ(redis_reply_bytes(":12\r\n:3\r\n"), 5u);
  EXPECT_EQ(redis_reply_bytes("-ERR no\r\n"), 9u);
  EXPECT_EQ(redis_reply_bytes("+OK\r\n"), 5u);
}

TEST(RedisTest, AListIsCompleteWithItsLastString) {
  const std::string list = "*2\r\n$1\r\n7\r\n$2\r\n12\r\n";
  EXPECT_EQ(redis_reply_bytes(list), list.size());
  EXPECT_EQ(redis_reply_bytes(list + "*0\r\n"), list.size());
  EXPECT_EQ(redis_reply_bytes("*0\r\n"), 4u);
}

TEST(RedisTest, EveryPrefixOfAReplyIsIncomplete) {
  const std::string list = "*2\r\n$1\r\n7\r\n$2\r\n12\r\n";
  for (size_t bytes = 0; bytes < list.size(); ++bytes)
    EXPECT_EQ(redis_reply_bytes(absl::string_view(list).substr(0, bytes)), 0u) << bytes;
}

TEST(RedisTest, AStartedServerAnswersSearchesAndReportsErrors) {
  // Determine without the code under test whether Redis is installed, so that a fault of that code makes the test fail.
  const bool is_installed =
      std::filesystem::exists("/usr/bin/redis-server") || std::filesystem::exists("/usr/bin/redis-check-rdb");
  if (!is_installed) GTEST_SKIP() << "Redis is not installed: deploy/packages.sh bench";
  const auto redis = Redis::start();
  ASSERT_TRUE(redis.ok()) << redis.status();
  (*redis)->run({redis_command({"GEOADD", "key", "0", "0", "a", "0.001", "0", "b", "1", "1", "c"})}, 1, 1);
  EXPECT_EQ((*redis)->counted(), 3u);
  const std::string search = redis_command({"GEOSEARCH", "key", "FROMLONLAT", "0", "0", "BYRADIUS", "1000", "m"});
  (*redis)->run({search}, 5, 2);
  EXPECT_EQ((*redis)->counted(), 10u);
  EXPECT_TRUE((*redis)->status().ok()) << (*redis)->status();
  (*redis)->run({redis_command({"GEOADD", "key"})}, 1, 1);
  EXPECT_FALSE((*redis)->status().ok());
}

}  // namespace
}  // namespace locus::bench::serving
