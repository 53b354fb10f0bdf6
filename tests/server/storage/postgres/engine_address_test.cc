#include "server/storage/postgres/engine_address.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

namespace locus::server {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::map<std::string, std::string> settings_at(const EngineAddress& address, size_t host) {
  const EngineAddress::Settings settings = address.settings_of(host);
  return {settings.begin(), settings.end()};
}

TEST(EngineAddressTest, NamesEachHostWithItsPort) {
  const auto address = EngineAddress::parse("postgresql://locus@one,two:5433,three/world?sslmode=verify-full");
  ASSERT_TRUE(address.ok()) << address.status();
  ASSERT_EQ(address->host_count(), 3u);
  EXPECT_EQ(address->host_name(0), "one:5432");
  EXPECT_EQ(address->host_name(1), "two:5433");
  auto settings = settings_at(*address, 1);
  EXPECT_EQ(settings["host"], "two");
  EXPECT_EQ(settings["port"], "5433");
  EXPECT_EQ(settings["user"], "locus");
  EXPECT_EQ(settings["dbname"], "world");
  EXPECT_EQ(settings["sslmode"], "verify-full");
  EXPECT_EQ(settings["target_session_attrs"], "read-write") << "a standby must never answer";
}

TEST(EngineAddressTest, OnePortServesAllHosts) {
  const auto address = EngineAddress::parse("postgresql:///world?host=one,two&port=6000&target_session_attrs=any");
  ASSERT_TRUE(address.ok()) << address.status();
  EXPECT_EQ(address->host_name(0), "one:6000");
  EXPECT_EQ(address->host_name(1), "two:6000");
  EXPECT_EQ(settings_at(*address, 0)["target_session_attrs"], "read-write");
}

TEST(EngineAddressTest, APasswordIsRefusedAndNeverRepeated) {
  for (const char* const url : {"postgresql://locus:secret@one/world", "postgresql://one/world?password=secret",
                                "postgresql://locus:secret@[::1/world"}) {
    const absl::Status status = EngineAddress::parse(url).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << url;
    EXPECT_THAT(std::string(status.message()), Not(HasSubstr("secret")));
  }
}

TEST(EngineAddressTest, AMalformedAddressIsRefusedWithAnExample) {
  for (const char* const url : {"", "one,two", "mysql://one/world", "postgresql://one/world?no_such_setting=1",
                                "postgresql:///world?host=a,b,c&port=1,2", "postgresql:///world?hostaddr=127.0.0.1"}) {
    const absl::Status status = EngineAddress::parse(url).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << url;
    EXPECT_THAT(std::string(status.message()), HasSubstr("postgresql://locus@host1,host2,host3/locus")) << url;
  }
}

}  // namespace
}  // namespace locus::server
