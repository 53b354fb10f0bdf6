#include "client/lib/advice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace locus::client {
namespace {

using ::testing::HasSubstr;

TEST(AdviceTest, ARefusedConnectionIsNotAFailedHandshake) {
  EXPECT_EQ(advice_on_connection("failed to connect to all addresses; last error: UNKNOWN: ipv4:127.0.0.1:1: Failed to "
                                 "connect to remote host: Connection refused"),
            "");
  EXPECT_EQ(advice_on_connection("Socket closed"), "") << "a connection that had been in use";
}

TEST(AdviceTest, ASocketThatAdmitsOtherUsersOnlyIsNotSilent) {
  EXPECT_THAT(advice_on_connection("failed to connect to all addresses; last error: UNKNOWN: unix:/run/locus.sock: "
                                   "Permission denied"),
              HasSubstr("permission denied"));
}

TEST(AdviceTest, AnUnknownNameOfTheServerIsNotASilentServer) {
  EXPECT_THAT(advice_on_connection("DNS resolution failed for locus.internal:7575: C-ares status is not ARES_SUCCESS "
                                   "qtype=A name=locus.internal is_balancer=0: Domain name not found"),
              HasSubstr("/etc/hosts"));
}

TEST(AdviceTest, ACauseThatIsKnownComesBeforeTheFailedHandshake) {
  EXPECT_THAT(advice_on_connection("Ssl handshake failed: SSL_ERROR_SSL: SSL routines::certificate verify failed"),
              HasSubstr("CA file"));
  EXPECT_THAT(advice_on_connection("Ssl handshake failed: SSL_ERROR_SSL: something new"), HasSubstr("agree on TLS"));
}

TEST(AdviceTest, RefusedIdentitiesAndRightsHaveAdvice) {
  EXPECT_THAT(advice_on(absl::StatusCode::kUnauthenticated, ""), HasSubstr("token"));
  EXPECT_THAT(advice_on(absl::StatusCode::kPermissionDenied, ""), HasSubstr("operator"));
  EXPECT_EQ(advice_on(absl::StatusCode::kNotFound, "Ssl handshake failed"), "");
}

}  // namespace
}  // namespace locus::client
