#include "server/observability/trace_context.h"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "server/config/observability_limits.h"

namespace locus::server {
namespace {

constexpr const char* kGood = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";

std::string with(size_t at, const std::string& text) { return std::string(kGood).replace(at, text.size(), text); }

TEST(TraceContextTest, AValidTraceparentIsAccepted) {
  EXPECT_TRUE(is_traceparent(kGood));
  EXPECT_TRUE(is_traceparent(with(53, "00")));
  EXPECT_TRUE(is_traceparent(with(0, "cc")));
  EXPECT_TRUE(is_traceparent(with(0, "cc") + "-what-the-future-holds"));
}

TEST(TraceContextTest, AnInvalidTraceparentIsNotAccepted) {
  for (const std::string& text : std::vector<std::string>{
           "", "00", std::string(kGood).substr(0, 54), std::string(kGood) + "-more", std::string(kGood) + "0",
           with(0, "ff"), with(0, "0x"), with(2, "_"), with(3, "4BF92F"), with(3, "zz"), with(35, "x"), with(52, " "),
           with(3, std::string(32, '0')), with(36, std::string(16, '0')), with(53, "0G"), with(53, "0\n"),
           with(0, "cc") + ".what", with(0, "cc") + "-with space", with(0, "cc") + "-" + std::string(200, 'a')})
    EXPECT_FALSE(is_traceparent(text)) << text;
}

TEST(TraceContextTest, ARequestIdIsShortAndHasOnlySafeCharacters) {
  for (const std::string& text : std::vector<std::string>{"a", "0", "A-b_c.9", std::string(kMaxRequestIdLength, 'x')})
    EXPECT_TRUE(is_request_id(text)) << text;
  for (const std::string& text : std::vector<std::string>{"", std::string(kMaxRequestIdLength + 1, 'x'), "a b", "a\n",
                                                          "a\"", "a=b", "\xc3\xa9", std::string("a\0b", 3)})
    EXPECT_FALSE(is_request_id(text)) << text;
}

TEST(TraceContextTest, GeneratedRequestIdsAreUniqueAndValid) {
  std::set<std::string> ids;
  for (int i = 0; i < 10000; ++i) {
    const std::string id = request_id_of(next_request_number());
    EXPECT_EQ(id.size(), 16u);
    EXPECT_TRUE(is_request_id(id));
    ids.insert(id);
  }
  EXPECT_EQ(ids.size(), 10000u);
  EXPECT_EQ(request_id_of(5), request_id_of(5));
}

}  // namespace
}  // namespace locus::server
