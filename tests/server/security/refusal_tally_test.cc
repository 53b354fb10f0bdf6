#include "server/security/refusal_tally.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"

namespace locus::server {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

AuditEntry refusal(const std::string& address, const std::string& principal = "anonymous") {
  AuditEntry entry;
  entry.principal = principal;
  entry.peer = absl::StrCat("ipv4:", address, ":1");
  entry.address = address;
  entry.code = absl::StatusCode::kUnauthenticated;
  entry.text = "needs credentials";
  return entry;
}

TEST(RefusalTallyTest, TheFirstRefusalsOfACallerAreWrittenAndTheOthersCounted) {
  RefusalTally tally;
  for (uint32_t i = 0; i < 10; ++i) EXPECT_EQ(tally.count(refusal("10.0.0.7")), i < RefusalTally::kMaxLines) << i;
  EXPECT_TRUE(tally.count(refusal("10.0.0.8")));
  EXPECT_TRUE(tally.count(refusal("10.0.0.7", "token:ci")));
  const std::vector<AuditEntry> notes = tally.end_window();
  ASSERT_THAT(notes, SizeIs(1));
  EXPECT_EQ(notes[0].peer, "10.0.0.7");
  EXPECT_EQ(notes[0].principal, "anonymous");
  EXPECT_EQ(notes[0].code, absl::StatusCode::kUnauthenticated);
  EXPECT_THAT(notes[0].text, HasSubstr("6 more refusals were not written, the last of them: needs credentials"));
}

TEST(RefusalTallyTest, EachWindowCountsAnew) {
  RefusalTally tally;
  EXPECT_THAT(tally.end_window(), IsEmpty());
  for (int window = 0; window < 3; ++window) {
    EXPECT_TRUE(tally.count(refusal("10.0.0.7")));
    EXPECT_THAT(tally.end_window(), IsEmpty());
  }
}

TEST(RefusalTallyTest, CallersBeyondTheMaximumShareOneCount) {
  RefusalTally tally;
  uint64_t written = 0;
  constexpr uint64_t kAddresses = 10'000;
  for (uint64_t i = 0; i < kAddresses; ++i) written += tally.count(refusal(absl::StrCat("10.0.0.", i))) ? 1 : 0;
  EXPECT_EQ(written, RefusalTally::kMaxCallers + RefusalTally::kMaxLines);
  const std::vector<AuditEntry> notes = tally.end_window();
  ASSERT_THAT(notes, SizeIs(1));
  EXPECT_EQ(notes[0].principal, "others");
  EXPECT_THAT(notes[0].text, HasSubstr(absl::StrCat(kAddresses - written, " more refusals")));
}

}  // namespace
}  // namespace locus::server
