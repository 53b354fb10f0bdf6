#include "server/security/hidden_users.h"

#include <gtest/gtest.h>

namespace locus::server {
namespace {

TEST(HiddenUsersTest, OnlyAMapOfAllUsersHidesNobody) {
  EXPECT_FALSE(hides_users("         0          0 4294967295\n"));
  EXPECT_TRUE(hides_users("         0          0          1\n     61184      61184          1\n"));
  EXPECT_TRUE(hides_users("         0     100000      65536\n"));
  EXPECT_FALSE(hides_users("0 0 1\n1 1 4294967294\n"));
}

TEST(HiddenUsersTest, TextThatIsNoMapHidesNobody) {
  for (const char* text : {"", "\n", "0 0", "0 0 many", "0 0 1 1"}) EXPECT_FALSE(hides_users(text)) << text;
}

}  // namespace
}  // namespace locus::server
