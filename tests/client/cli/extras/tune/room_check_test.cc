#include "client/cli/extras/tune/room_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace locus::cli {
namespace {

using ::testing::HasSubstr;

v1::GetServerResponse server_with(const std::string& name, double value, double used) {
  v1::GetServerResponse server;
  v1::Limit& limit = *server.add_limits();
  limit.set_name(name);
  limit.set_value(value);
  limit.set_used(used);
  return server;
}

v1::IdentityQuotas quotas_with(const std::string& name, double limit, double available) {
  v1::IdentityQuotas quotas;
  quotas.set_identity("token:ci");
  v1::QuotaUse& quota = *quotas.add_quotas();
  quota.set_name(name);
  quota.set_limit(limit);
  quota.set_available(available);
  return quotas;
}

constexpr ScratchNeed kNeed = {.scenes = 6, .objects = 6'000'000, .bytes = 1'234'567'890};

TEST(RoomCheckTest, MemoryThatDoesNotSufficeIsNamedWithBothFigures) {
  EXPECT_TRUE(check_room(kNeed, server_with("memory_bytes", 4e9, 2e9), {}).ok());
  const absl::Status refused = check_room(kNeed, server_with("memory_bytes", 3e9, 2e9), {});
  EXPECT_TRUE(absl::IsResourceExhausted(refused));
  EXPECT_THAT(refused.message(), HasSubstr("6 scratch scenes"));
  EXPECT_THAT(refused.message(), HasSubstr("need 1234567890 of memory_bytes, but only 625000000 of 3000000000"));
}

TEST(RoomCheckTest, UsedMemoryAboveTheLimitLeavesNone) {
  EXPECT_THAT(check_room(kNeed, server_with("memory_bytes", 1e9, 2e9), {}).message(), HasSubstr("but only 0 of"));
}

TEST(RoomCheckTest, TooFewScenesAreRefused) {
  EXPECT_TRUE(check_room(kNeed, server_with("scenes", 10, 4), {}).ok());
  EXPECT_FALSE(check_room(kNeed, server_with("scenes", 10, 5), {}).ok());
}

TEST(RoomCheckTest, QuotasOfTheCallerCount) {
  const v1::IdentityQuotas enough[] = {quotas_with("objects", 1e7, 6e6), quotas_with("scenes", 10, 6)};
  EXPECT_TRUE(check_room(kNeed, {}, enough).ok());
  const v1::IdentityQuotas objects[] = {quotas_with("objects", 1e7, 5e6)};
  EXPECT_THAT(check_room(kNeed, {}, objects).message(),
              HasSubstr("the quota objects of token:ci, but only 5000000 of"));
  const v1::IdentityQuotas scenes[] = {quotas_with("scenes", 10, 5)};
  EXPECT_FALSE(check_room(kNeed, {}, scenes).ok());
  v1::IdentityQuotas unlimited = quotas_with("objects", 1, 1);
  unlimited.mutable_quotas(0)->clear_limit();
  EXPECT_TRUE(check_room(kNeed, {}, {&unlimited, 1}).ok());
}

}  // namespace
}  // namespace locus::cli
