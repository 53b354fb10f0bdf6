#include "core/base/progress_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <string>

namespace locus {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Collects what a writer writes, and lets a test wait for a number of writes.
class Written {
 public:
  ProgressOptions options(ProgressStyle style) {
    return {.style = style,
            .now = [] { return std::chrono::steady_clock::now(); },
            .write =
                [this](absl::string_view text) {
                  const MutexLock lock(mutex_);
                  text_.append(text.data(), text.size());
                  ++writes_;
                  changed_.notify_all();
                }};
  }
  void wait_for(int writes) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::minutes(1);
    const MutexLock lock(mutex_);
    while (writes_ < writes && changed_.wait_until(mutex_, deadline)) {
    }
    EXPECT_GE(writes_, writes);
  }
  std::string text() {
    const MutexLock lock(mutex_);
    return text_;
  }

 private:
  Mutex mutex_;
  ConditionVariable changed_;
  std::string text_ LOCUS_GUARDED_BY(mutex_);
  int writes_ LOCUS_GUARDED_BY(mutex_) = 0;
};

TEST(ProgressWriterTest, TheLineIsRedrawnWhileTheWorkBlocks) {
  Written written;
  ProgressWriter writer(written.options(ProgressStyle::kLive));
  writer.begin({.action = "building", .subject = "a tree"});
  written.wait_for(3);  // this thread does nothing meanwhile
  EXPECT_THAT(written.text(), HasSubstr("building a tree"));
}

TEST(ProgressWriterTest, LinesAreWrittenWhileTheWorkBlocks) {
  Written written;
  ProgressWriter writer(written.options(ProgressStyle::kLines));
  writer.begin({.action = "building", .subject = "a tree"});
  written.wait_for(2);
  EXPECT_THAT(written.text(), ::testing::ContainsRegex("building a tree  [1-9][0-9]* s\n"));
}

TEST(ProgressWriterTest, TheEndErasesTheLine) {
  Written written;
  {
    ProgressWriter writer(written.options(ProgressStyle::kLive));
    writer.begin({.action = "sending", .unit = "rows"});
    writer.update(10, 20);
    writer.hide();
    writer.update_share(12, 0.6);
    writer.show();
  }
  EXPECT_THAT(written.text(), EndsWith("\r\x1b[K"));
  EXPECT_THAT(written.text(), HasSubstr("12 of 20 rows"));
}

TEST(ProgressWriterTest, ASilentWriterWritesNothing) {
  Written written;
  {
    ProgressWriter writer(written.options(ProgressStyle::kSilent));
    writer.begin({.action = "sending", .unit = "rows"});
    writer.update(10, 20);
    writer.hide();
    writer.show();
  }
  EXPECT_THAT(written.text(), IsEmpty());
}

}  // namespace
}  // namespace locus
