#include "server/config/listen_address.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace locus::server {
namespace {

TEST(ListenAddressTest, LoopbackAndUnixAddressesAreLocalAndOthersAreNot) {
  for (const char* text : {"127.0.0.1:7575", "127.8.9.10:1", "[::1]:7575", "localhost:0", "unix:/tmp/locus.sock"}) {
    const absl::StatusOr<ListenAddress> address = parse_listen_address(text);
    ASSERT_TRUE(address.ok()) << text << ": " << address.status();
    EXPECT_TRUE(address->local) << text;
  }
  for (const char* text : {"0.0.0.0:7575", "[::]:7575", "192.168.0.1:1", "example.org:1", "127.0.0.1.example.org:1"}) {
    const absl::StatusOr<ListenAddress> address = parse_listen_address(text);
    ASSERT_TRUE(address.ok()) << text << ": " << address.status();
    EXPECT_FALSE(address->local) << text;
  }
}

TEST(ListenAddressTest, AnInvalidAddressIsRefusedWithAnExample) {
  for (const char* text : {"", "7575", "127.0.0.1", "127.0.0.1:", "127.0.0.1:65536", "127.0.0.1:-1", ":7575",
                           "::1:7575", "unix:", "unix:relative.sock"}) {
    const absl::StatusOr<ListenAddress> address = parse_listen_address(text);
    EXPECT_EQ(address.status().code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(address.status().message()), testing::HasSubstr("127.0.0.1:7575")) << text;
  }
  EXPECT_FALSE(parse_listen_address("unix:/" + std::string(200, 'a')).ok());
}

TEST(ListenAddressTest, AnAddressIsPrintedInTheFormThatIsParsed) {
  for (const char* text : {"127.0.0.1:7575", "[::1]:7575", "unix:/tmp/locus.sock"})
    EXPECT_EQ(to_string(*parse_listen_address(text), 7575), text);
}

TEST(ListenAddressTest, PermissionsAreThreeOctalDigits) {
  EXPECT_EQ(*parse_unix_mode("0600"), 0600u);
  EXPECT_EQ(*parse_unix_mode("666"), 0666u);
  for (const char* text : {"", "6", "0800", "rw-", "1600", "06000"}) EXPECT_FALSE(parse_unix_mode(text).ok()) << text;
}

}  // namespace
}  // namespace locus::server
