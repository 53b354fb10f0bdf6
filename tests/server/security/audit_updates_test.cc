#include "server/security/audit_updates.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>

#include "absl/strings/str_cat.h"
#include "tests/support/temporary_folder.h"

namespace locus::server {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

class AuditUpdatesTest : public testing::Test {
 protected:
  static constexpr int64_t kStart = 1'700'000'000'000;

  static AuditedUpdate update(absl::string_view principal, absl::string_view scene, uint64_t items) {
    return {principal, "ipv4:10.0.0.7:1", "/locus.v1.UpdateService/StreamUpdates", scene, items};
  }
  std::string written() {
    log_->flush();
    std::ostringstream text;
    text << std::ifstream(file_).rdbuf();
    return text.str();
  }
  static size_t lines(const std::string& text) {
    return static_cast<size_t>(std::count(text.begin(), text.end(), '\n'));
  }

  test::TemporaryFolder folder_;
  const std::string file_ = folder_.file("audit");
  std::unique_ptr<AuditLog> log_ = *AuditLog::open(file_, 1u << 24);
};

TEST_F(AuditUpdatesTest, AMinuteOfUpdatesIsALineForEachPrincipalAndScene) {
  AuditUpdates updates(*log_);
  for (int64_t i = 0; i < 1000; ++i) updates.count(update("token:a", "arena", 5), kStart + i);
  updates.count(update("token:a", "lobby", 1), kStart);
  updates.count(update("token:b", "arena", 0), kStart);
  updates.tick(kStart + 59'999);
  EXPECT_THAT(written(), IsEmpty());
  updates.tick(kStart + 60'000);
  const std::string text = written();
  EXPECT_EQ(lines(text), 3u);
  EXPECT_THAT(text, HasSubstr(R"("principal":"token:a","peer":"ipv4:10.0.0.7:1")"));
  EXPECT_THAT(text, HasSubstr(R"("subject":"arena","code":"OK","request_id":"","text":"1000 batches changed 5000 )"
                              "objects in 999 ms"));
  updates.tick(kStart + 120'000);
  EXPECT_EQ(lines(written()), 3u) << "counted anew";
}

TEST_F(AuditUpdatesTest, TheDestructorWritesWhatIsCounted) {
  { AuditUpdates(*log_).count(update("token:a", "arena", 5), kStart); }
  EXPECT_EQ(lines(written()), 1u);
}

TEST_F(AuditUpdatesTest, ManyPairsAreWrittenEarlyAndNoneIsLost) {
  AuditUpdates updates(*log_);
  for (size_t i = 0; i < kMaxAuditedPairs; ++i) updates.count(update("token:a", absl::StrCat("s", i), 1), kStart);
  updates.count(update("token:a", "s0", 1), kStart);
  EXPECT_THAT(written(), IsEmpty());
  updates.count(update("token:a", "one-more", 1), kStart);
  EXPECT_EQ(lines(written()), kMaxAuditedPairs);
  updates.tick(kStart + 60'000);
  EXPECT_EQ(lines(written()), kMaxAuditedPairs + 1);
}

TEST_F(AuditUpdatesTest, AClockThatIsSetBackDoesNotHoldLinesBack) {
  AuditUpdates updates(*log_);
  updates.count(update("token:a", "arena", 1), kStart);
  updates.tick(kStart - 1'000'000);
  EXPECT_EQ(lines(written()), 1u);
}

}  // namespace
}  // namespace locus::server
