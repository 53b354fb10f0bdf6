#include "client/cli/extras/top/metrics_address.h"

#include <gtest/gtest.h>

namespace locus::cli {
namespace {

std::string found(const std::string& address, const std::string& http_host) {
  v1::GetServerResponse server;
  server.set_http_port(7576);
  server.set_http_host(http_host);
  const absl::StatusOr<std::string> result = metrics_address(address, server);
  return result.ok() ? *result : std::string(result.status().message());
}

TEST(MetricsAddressTest, TheHostIsThatOfTheServer) {
  EXPECT_EQ(found("127.0.0.1:7575", "127.0.0.1"), "127.0.0.1:7576");
  EXPECT_EQ(found("game.example.com:7575", "0.0.0.0"), "game.example.com:7576");
  EXPECT_EQ(found("game.example.com", "::"), "game.example.com:7576");
  EXPECT_EQ(found("[::1]:7575", "::"), "[::1]:7576");
  EXPECT_EQ(found("::1", "::"), "[::1]:7576");
}

TEST(MetricsAddressTest, AUnixSocketIsOnThisMachine) { EXPECT_EQ(found("unix:/run/locus.sock", ""), "127.0.0.1:7576"); }

TEST(MetricsAddressTest, ACertainHostOfTheHttpPortWins) {
  EXPECT_EQ(found("127.0.0.1:7575", "10.0.0.7"), "10.0.0.7:7576");
  EXPECT_EQ(found("127.0.0.1:7575", "fd00::7"), "[fd00::7]:7576");
}

TEST(MetricsAddressTest, AServerWithoutHttpPortIsReported) {
  EXPECT_EQ(metrics_address("127.0.0.1:7575", {}).status().code(), absl::StatusCode::kFailedPrecondition);
}

}  // namespace
}  // namespace locus::cli
