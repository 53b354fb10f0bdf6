#include "server/security/audit_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <jansson.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/security/json_value.h"
#include "tests/support/temporary_folder.h"

namespace locus::server {
namespace {

class AuditLogTest : public testing::Test {
 protected:
  std::vector<std::string> lines(const std::string& ending = "") {
    std::vector<std::string> lines;
    std::ifstream file(file_ + ending);
    for (std::string line; std::getline(file, line);) lines.push_back(line);
    return lines;
  }
  static AuditEntry entry(const std::string& text) {
    AuditEntry made;
    made.unix_ms = 1'700'000'000'000;
    made.text = text;
    return made;
  }

  test::TemporaryFolder folder_;
  const std::string file_ = folder_.file("audit");
};

TEST_F(AuditLogTest, EntriesAreWrittenInTheirOrder) {
  auto log = *AuditLog::open(file_, 1u << 20);
  for (int i = 0; i < 100; ++i) log->write(entry(absl::StrCat("entry ", i)));
  log->flush();
  const std::vector<std::string> written = lines();
  ASSERT_EQ(written.size(), 100u);
  for (int i = 0; i < 100; ++i) EXPECT_THAT(written[i], testing::HasSubstr(absl::StrCat("\"entry ", i, "\"")));
  EXPECT_EQ(log->lost(), 0u);
}

TEST_F(AuditLogTest, TheDestructorWritesWhatIsQueued) {
  {
    auto log = *AuditLog::open(file_, 1u << 20);
    for (int i = 0; i < 1000; ++i) log->write(entry("x"));
  }
  EXPECT_EQ(lines().size(), 1000u);
}

// However fast the writer is, the written and the lost entries add up to all entries, and the file reports every lost
// entry.
TEST_F(AuditLogTest, AFullQueueCountsAndReportsDroppedEntries) {
  constexpr uint64_t kEntries = 20000;
  uint64_t lost = 0;
  {
    auto log = *AuditLog::open(file_, 64u << 20, 4);
    for (uint64_t i = 0; i < kEntries; ++i) log->write(entry("x"));
    log->flush();
    lost = log->lost();
  }
  uint64_t written = 0, said = 0;
  for (const std::string& line : lines()) {
    const JsonPointer parsed = parse_json_object(line);
    ASSERT_NE(parsed, nullptr) << line;
    const std::string text(json_text(json_object_get(parsed.get(), "text")));
    if (text == "x") {
      ++written;
    } else {
      EXPECT_THAT(text, testing::HasSubstr("entries are missing here"));
      said += std::stoull(text);
    }
  }
  EXPECT_EQ(written + lost, kEntries);
  EXPECT_EQ(said, lost);
  EXPECT_GT(lost, 0u);  // a queue of 4 fills while a line is written to the disk
}

TEST_F(AuditLogTest, AfterReopenAMovedFileIsCreatedAgain) {
  auto log = *AuditLog::open(file_, 1u << 20);
  log->write(entry("a"));
  log->flush();
  std::filesystem::rename(file_, file_ + ".moved");
  log->reopen();
  log->write(entry("b"));
  log->flush();
  EXPECT_EQ(lines(".moved").size(), 1u);
  EXPECT_EQ(lines().size(), 1u);
}

TEST_F(AuditLogTest, TheFileIsRotatedBySizeAndPrivate) {
  auto log = *AuditLog::open(file_, 1000);
  for (int i = 0; i < 100; ++i) log->write(entry("x"));
  log->flush();
  for (const char* const ending : {"", ".1", ".2", ".3", ".4"}) {
    ASSERT_TRUE(std::filesystem::exists(file_ + ending)) << ending;
    EXPECT_LE(std::filesystem::file_size(file_ + ending), 1000u);
    EXPECT_EQ(std::filesystem::status(file_ + ending).permissions(), std::filesystem::perms(0600));
  }
  EXPECT_FALSE(std::filesystem::exists(file_ + ".5"));
}

TEST_F(AuditLogTest, RefusalsNeitherRotateChangesAwayNorWriteMoreThanAFewLines) {
  {
    auto log = *AuditLog::open(file_, 100'000);
    log->write(entry("a change"));
    AuditEntry refusal = entry("no token");
    refusal.code = absl::StatusCode::kUnauthenticated;
    for (int i = 0; i < 10'000; ++i) {
      refusal.peer = absl::StrCat("ipv4:10.0.0.7:", i);
      refusal.address = "10.0.0.7";
      log->write(refusal);
    }
    EXPECT_EQ(log->lost(), 0u);
  }
  ASSERT_EQ(lines().size(), 1u);
  EXPECT_THAT(lines()[0], testing::HasSubstr("a change"));
  EXPECT_FALSE(std::filesystem::exists(file_ + ".1"));
  uint64_t refusals = 0;
  for (const char* const ending : {".refused", ".refused.1", ".refused.2", ".refused.3", ".refused.4"}) {
    for (const std::string& line : lines(ending)) {
      const JsonPointer parsed = parse_json_object(line);
      ASSERT_NE(parsed, nullptr) << line;
      const std::string text(json_text(json_object_get(parsed.get(), "text")));
      refusals += text == "no token" ? 1 : std::stoull(text);
    }
  }
  EXPECT_EQ(refusals, 10'000u);
}

// Refusals fill at most half of the queue of unwritten entries, so that changes still find room.
TEST_F(AuditLogTest, RefusalsLeaveHalfOfTheQueueToChanges) {
  auto log = *AuditLog::open(file_, 1u << 20, 0);
  log->write(entry("dropped, because the queue has no room at all"));
  log->flush();
  EXPECT_EQ(log->lost(), 1u);
  auto half = *AuditLog::open(folder_.file("half"), 1u << 20, 1);  // half of a queue of 1 has no room
  AuditEntry refusal = entry("no token");
  refusal.code = absl::StatusCode::kUnauthenticated;
  half->write(refusal);
  EXPECT_EQ(half->lost(), 1u);
  half->write(entry("a change"));
  EXPECT_EQ(half->lost(), 1u);
}

TEST_F(AuditLogTest, ThreadsWriteWholeLines) {
  std::vector<std::thread> threads;
  {
    auto log = *AuditLog::open(file_, 1u << 20, 1u << 20);
    for (int t = 0; t < 4; ++t)
      threads.emplace_back([&] {
        for (int i = 0; i < 500; ++i) log->write(entry("x"));
        log->reopen();
        log->flush();
      });
    for (std::thread& thread : threads) thread.join();
  }
  EXPECT_EQ(lines().size(), 2000u);
  for (const std::string& line : lines()) EXPECT_NE(parse_json_object(line), nullptr) << line;
}

}  // namespace
}  // namespace locus::server
